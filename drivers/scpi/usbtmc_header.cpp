#include "drivers/scpi/usbtmc_header.hpp"

#include <algorithm>

namespace kphi::scpi::usbtmc {
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

}  // namespace kphi::scpi::usbtmc
