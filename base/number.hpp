// Numbers in files and addresses, whatever the locale: text to number, and the shortest text that reads back as the
// same bits.
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace kphi {

/// Shortest round trip (std::to_chars): 45, 1e-06, nan.
[[nodiscard]] std::string shortest(double value);
void append_shortest(std::string& text, double value);

/// As `shortest`, but every YAML 1.1 and 1.2 reader takes it for a float: the mantissa has a '.', the exponent a sign
/// (45.0, 1.0e-06, 1.0e+300). Throws std::invalid_argument for NaN and infinities.
[[nodiscard]] std::string yaml_number(double value);

/// "1.5500e-06 ± 1.2e-09": the value to the second digit of what follows ±; six digits where that is not positive.
[[nodiscard]] std::string with_error(double value, double half_width);

/// "1.0081 ± 0.0073": the same without an exponent, for numbers near 1. Six digits where `half_width` is not positive.
[[nodiscard]] std::string plain_with_error(double value, double half_width);

/// "0.012", "3.4", "210": two digits, without an exponent above 1.
[[nodiscard]] std::string two_digits(double value);

/// "812 B", "23.41 MB", "1.204 GB": four digits, by powers of 1000.
[[nodiscard]] std::string bytes_in_words(std::uint64_t bytes);

/// The whole of `text` as a number (std::from_chars), NaN and infinities included; nullopt for anything else, such as
/// "", " 1" and "+1".
[[nodiscard]] std::optional<double> parse_double(std::string_view text);

/// As parse_double; nullopt also for NaN and infinities.
[[nodiscard]] std::optional<double> parse_finite(std::string_view text);

/// The whole of `text` as a whole number that fits the type; nullopt for anything else, such as "", " 1", "+1", "0x1".
template <class Integer>
[[nodiscard]] std::optional<Integer> parse_integer(std::string_view text, int base = 10) {
  Integer value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace kphi
