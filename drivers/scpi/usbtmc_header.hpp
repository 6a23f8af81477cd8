// The twelve bytes before every bulk transfer of USBTMC (Test and Measurement Class 1.0, 3.2 and 3.3). Pure bytes.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace kphi::scpi::usbtmc {

inline constexpr std::size_t kHeaderBytes = 12;

/// 1..255 and again: 0 is never a tag.
[[nodiscard]] constexpr std::uint8_t next_tag(std::uint8_t tag) noexcept {
  return tag == 255 ? std::uint8_t{1} : static_cast<std::uint8_t>(tag + 1);
}

/// A whole message to the instrument, padded to a multiple of four (DEV_DEP_MSG_OUT, end of message).
[[nodiscard]] std::vector<std::uint8_t> message_out(std::uint8_t tag, std::string_view text);
/// Asks for at most `bytes` of an answer (REQUEST_DEV_DEP_MSG_IN).
[[nodiscard]] std::array<std::uint8_t, kHeaderBytes> request_in(std::uint8_t tag, std::uint32_t bytes) noexcept;

struct AnswerHeader {
  std::uint32_t bytes = 0;  ///< of data that follow
  bool end_of_message = false;
};

/// Nothing unless it is a DEV_DEP_MSG_IN with this tag and its complement.
[[nodiscard]] std::optional<AnswerHeader> answer_header(std::span<const std::uint8_t> bytes, std::uint8_t tag) noexcept;

}  // namespace kphi::scpi::usbtmc
