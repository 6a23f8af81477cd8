// SCPI's numbers and fields as text, and USBTMC's message headers as bytes. Pure functions.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::scpi {

/// The whole text, blanks around it allowed, as one finite number, whatever the locale (IEEE 488.2, 7.7.2 and 8.7: NR1,
/// NR2, NR3). nullopt otherwise, and for 9.9E37 and 9.91E37, SCPI's infinity and "not a number" (SCPI-99, 7.2.1.4 and
/// 5).
[[nodiscard]] std::optional<double> number_of(std::string_view text) noexcept;

/// With as many decimals as `step` has, rounded to nearest: what is sent is what was meant. `step` > 0.
[[nodiscard]] std::string number_text(double value, double step);

/// Maker, model, serial number, firmware, from an answer to *IDN? (IEEE 488.2, 10.14); empty where it is shorter.
[[nodiscard]] std::array<std::string, 4> identity_fields(const std::string& identity);

/// The twelve bytes before every bulk transfer (Test and Measurement Class 1.0, 3.2 and 3.3).
namespace usbtmc {

inline constexpr std::size_t kHeaderBytes = 12;

/// 1..255 and again: 0 is never a tag.
[[nodiscard]] constexpr std::uint8_t next_tag(std::uint8_t tag) noexcept {
  return tag == 255 ? std::uint8_t{1} : static_cast<std::uint8_t>(tag + 1);
}

/// A complete message to the instrument, padded to a multiple of four (DEV_DEP_MSG_OUT, end of message).
[[nodiscard]] std::vector<std::uint8_t> message_out(std::uint8_t tag, std::string_view text);
/// Asks for at most `bytes` of an answer (REQUEST_DEV_DEP_MSG_IN).
[[nodiscard]] std::array<std::uint8_t, kHeaderBytes> request_in(std::uint8_t tag, std::uint32_t bytes) noexcept;

struct AnswerHeader {
  std::uint32_t bytes = 0;  ///< of data that follow
  bool end_of_message = false;
};

/// nullopt unless it is a DEV_DEP_MSG_IN with this tag and its complement.
[[nodiscard]] std::optional<AnswerHeader> answer_header(std::span<const std::uint8_t> bytes, std::uint8_t tag) noexcept;

}  // namespace usbtmc
}  // namespace kphi::scpi
