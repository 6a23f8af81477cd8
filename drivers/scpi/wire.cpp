#include "drivers/scpi/wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace kphi::scpi {

std::optional<double> number_of(std::string_view text) noexcept {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
    if (!text.empty() && text.front() == '-') return std::nullopt;
  }
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(std::abs(value) < 9.8e37)) return std::nullopt;
  return value;
}

std::string number_text(double value, double step) {
  const int decimals = std::clamp(static_cast<int>(std::ceil(-std::log10(step) - 1e-9)), 0, 9);
  return fmt::format("{:.{}f}", std::round(value / step) * step, decimals);
}

std::array<std::string, 4> identity_fields(const std::string& identity) {
  std::array<std::string, 4> fields;
  std::size_t from = 0;
  for (std::string& field : fields) {
    const std::size_t comma = identity.find(',', from);
    field = identity.substr(from, comma - from);
    if (comma == std::string::npos) break;
    from = comma + 1;
  }
  return fields;
}

namespace usbtmc {
namespace {

constexpr std::uint8_t kMessageOut = 1, kMessageIn = 2, kEndOfMessage = 1;

std::array<std::uint8_t, kHeaderBytes> header(std::uint8_t id, std::uint8_t tag, std::uint32_t bytes,
                                              std::uint8_t attributes) noexcept {
  const auto byte = [&](int i) { return static_cast<std::uint8_t>(bytes >> (8 * i)); };
  return {id, tag, static_cast<std::uint8_t>(~tag), 0, byte(0), byte(1), byte(2), byte(3), attributes, 0, 0, 0};
}

}  // namespace

std::vector<std::uint8_t> message_out(std::uint8_t tag, std::string_view text) {
  const auto head = header(kMessageOut, tag, static_cast<std::uint32_t>(text.size()), kEndOfMessage);
  std::vector<std::uint8_t> bytes((kHeaderBytes + text.size() + 3) / 4 * 4, 0);
  std::copy(text.begin(), text.end(), std::copy(head.begin(), head.end(), bytes.begin()));
  return bytes;
}

std::array<std::uint8_t, kHeaderBytes> request_in(std::uint8_t tag, std::uint32_t bytes) noexcept {
  return header(kMessageIn, tag, bytes, 0);
}

std::optional<AnswerHeader> answer_header(std::span<const std::uint8_t> b, std::uint8_t tag) noexcept {
  if (b.size() < kHeaderBytes || b[0] != kMessageIn || b[1] != tag || b[2] != static_cast<std::uint8_t>(~tag))
    return std::nullopt;
  const std::uint32_t bytes = b[4] | static_cast<std::uint32_t>(b[5]) << 8 | static_cast<std::uint32_t>(b[6]) << 16 |
                              static_cast<std::uint32_t>(b[7]) << 24;
  return AnswerHeader{bytes, (b[8] & kEndOfMessage) != 0};
}

}  // namespace usbtmc
}  // namespace kphi::scpi
