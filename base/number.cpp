#include "base/number.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace kphi {

void append_shortest(std::string& text, double value) {
  std::array<char, 32> digits{};
  const auto [end, error] = std::to_chars(digits.data(), digits.data() + digits.size(), value);
  text.append(digits.data(), end);
}

std::string shortest(double value) {
  std::string text;
  append_shortest(text, value);
  return text;
}

std::string yaml_number(double value) {
  if (!std::isfinite(value))
    throw std::invalid_argument("a coefficient file holds finite numbers only, not " + shortest(value));
  std::string text = shortest(value);
  const std::size_t e = text.find('e');
  std::string mantissa = text.substr(0, e);
  if (mantissa.find('.') == std::string::npos) mantissa += ".0";
  return e == std::string::npos ? mantissa : mantissa + text.substr(e);  // to_chars always signs the exponent
}

std::string with_error(double value, double half_width) {
  if (!(half_width > 0) || !std::isfinite(half_width) || !(std::abs(value) > 0)) return fmt::format("{:.5e}", value);
  const double digits = std::floor(std::log10(std::abs(value))) - std::floor(std::log10(half_width)) + 1;
  return fmt::format("{:.{}e} ± {:.1e}", value, static_cast<int>(std::clamp(digits, 1.0, 12.0)), half_width);
}

std::string plain_with_error(double value, double half_width) {
  if (!(half_width > 0) || !std::isfinite(half_width)) return fmt::format("{:.6g}", value);
  const int digits = static_cast<int>(std::clamp(1 - std::floor(std::log10(half_width)), 0.0, 12.0));
  return fmt::format("{:.{}f} ± {:.{}f}", value, digits, half_width, digits);
}

std::optional<double> parse_double(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> parse_finite(std::string_view text) {
  const auto value = parse_double(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string two_digits(double value) {
  return std::abs(value) >= 99.5 ? fmt::format("{:.0f}", value) : fmt::format("{:.2g}", value);
}

std::string bytes_in_words(std::uint64_t bytes) {
  constexpr std::array kUnits{"B", "kB", "MB", "GB", "TB"};
  auto value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 999.95 && unit + 1 < kUnits.size(); ++unit) value /= 1000;
  return fmt::format("{:.4g} {}", value, kUnits[unit]);
}

}  // namespace kphi
