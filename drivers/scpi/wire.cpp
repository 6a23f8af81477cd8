#include "drivers/scpi/wire.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/endian/conversion.hpp>
#include <cmath>

#include "base/number.hpp"

namespace kphi::scpi {

std::optional<double> number_of(std::string_view text) noexcept {
  constexpr std::string_view kBlanks = " \t\r\n";
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  text = text.substr(0, text.find_last_not_of(kBlanks) + 1);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  const auto value = parse_finite(text);
  return value && std::abs(*value) < 9.8e37 ? value : std::nullopt;
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
  std::array<std::uint8_t, kHeaderBytes> all{id, tag, static_cast<std::uint8_t>(~tag)};
  boost::endian::store_little_u32(&all[4], bytes);
  all[8] = attributes;
  return all;
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
  return AnswerHeader{boost::endian::load_little_u32(&b[4]), (b[8] & kEndOfMessage) != 0};
}

}  // namespace usbtmc
}  // namespace kphi::scpi
