// Bytes as the manuals print them.
#pragma once

#include <cctype>
#include <cstdint>
#include <cstdio>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kphi::sim::test {

inline std::vector<std::uint8_t> bytes(std::string_view hex) {
  std::vector<std::uint8_t> out;
  std::string digits;
  for (const char c : hex) {
    if (std::isxdigit(static_cast<unsigned char>(c)) != 0) digits += c;
    if (digits.size() == 2) {
      out.push_back(static_cast<std::uint8_t>(std::stoi(digits, nullptr, 16)));
      digits.clear();
    }
  }
  return out;
}

inline std::string hex(std::span<const std::uint8_t> data) {
  std::string out;
  for (const std::uint8_t byte : data) {
    char text[4];
    std::snprintf(text, sizeof text, "%02x ", byte);
    out += text;
  }
  return out;
}

inline std::string hex(std::string_view spelt) { return hex(bytes(spelt)); }

}  // namespace kphi::sim::test
