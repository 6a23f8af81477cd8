// Numbers as text, without a library of formats: what flies must not need one.
#pragma once

#include <charconv>
#include <cstdio>
#include <string>

namespace kphi::flight {

/// Shortest text that reads back as the same bits.
[[nodiscard]] inline std::string shortest(double value) {
  char digits[32];
  return std::string(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

/// `value` with `decimals` digits behind the dot, right-aligned in `width`.
[[nodiscard]] inline std::string aligned(double value, int decimals, int width) {
  char digits[64];
  const int length = std::snprintf(digits, sizeof digits, "%*.*f", width, decimals, value);
  return std::string(digits, static_cast<std::size_t>(length));
}

/// `text`, left-aligned in `width` columns; counts the bytes of ASCII.
[[nodiscard]] inline std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.resize(width, ' ');
  return text;
}

}  // namespace kphi::flight
