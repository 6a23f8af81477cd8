#include "profiles/scalar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>

namespace kphi::profiles {
namespace {

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return result;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool only(std::string_view text, std::string_view allowed) {
  return text.find_first_not_of(allowed) == std::string_view::npos;
}

bool contains(std::string_view text, char c) { return text.find(c) != std::string_view::npos; }

bool is_boolean_elsewhere(const std::string& word) {
  static constexpr std::array<std::string_view, 8> kWords{"yes", "no", "on", "off", "y", "n", "true", "false"};
  return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
}

bool is_not_finite(std::string_view word) {
  if (!word.empty() && (word[0] == '+' || word[0] == '-')) word.remove_prefix(1);
  return word == ".inf" || word == ".nan" || word == "inf" || word == "infinity" || word == "nan";
}

/// `digits` has no sign. Why other readers, or the reader of this page, may see another number in it.
std::optional<std::string> doubtful_number(std::string_view digits) {
  if (digits.empty() || !is_digit(digits[0])) return std::nullopt;
  const bool leading_zero = digits.size() > 1 && digits[0] == '0' && is_digit(digits[1]);
  if (leading_zero && only(digits, "0123456789.eE+-_")) return "looks octal";
  const std::string prefix = lower(digits.substr(0, 2));
  if ((prefix == "0x" && only(digits.substr(2), "0123456789abcdefABCDEF_")) ||
      (prefix == "0o" && only(digits.substr(2), "01234567_")) || (prefix == "0b" && only(digits.substr(2), "01_"))) {
    return "is not decimal";
  }
  if (contains(digits, '_') && only(digits, "0123456789_.")) return "has separators";
  if (contains(digits, ',') && only(digits, "0123456789,.")) return "has separators";
  if (contains(digits, ':') && only(digits, "0123456789:")) return "is base 60 to some readers";
  return std::nullopt;
}

bool looks_decimal(std::string_view digits) {
  if (digits.empty() || !only(digits, "0123456789.eE+-")) return false;
  return is_digit(digits[0]) || (digits[0] == '.' && digits.size() > 1 && is_digit(digits[1]));
}

/// null: not a number after all ("1.2.3").
nlohmann::json decimal(std::string_view digits, bool negative, bool& out_of_range) {
  const char* end = digits.data() + digits.size();
  std::int64_t whole = 0;
  if (const auto [stop, error] = std::from_chars(digits.data(), end, whole); error == std::errc{} && stop == end) {
    return negative ? -whole : whole;
  }
  double number = 0;
  const auto [stop, error] = std::from_chars(digits.data(), end, number);
  if (stop != end) return nullptr;
  out_of_range = error != std::errc{};
  return negative ? -number : number;
}

}  // namespace

Scalar read_plain_scalar(const std::string& text) {
  if (text == "true" || text == "false") return {text == "true", "", ""};
  const std::string word = lower(text);
  if (is_boolean_elsewhere(word)) {
    return {nullptr, fmt::format("{} is a boolean to some YAML readers and text to others", text),
            fmt::format("write true or false, or quote it: \"{}\"", text)};
  }
  if (is_not_finite(word)) return {nullptr, fmt::format("{} is not a finite number", text), "write a finite number"};

  const bool has_sign = text[0] == '+' || text[0] == '-';
  const std::string_view digits = std::string_view(text).substr(has_sign ? 1 : 0);
  if (const auto doubt = doubtful_number(digits)) {
    return {nullptr, fmt::format("{} {}", text, *doubt), "write a plain decimal number, or quote it if it is text"};
  }
  if (looks_decimal(digits)) {
    bool out_of_range = false;
    auto number = decimal(digits, text[0] == '-', out_of_range);
    if (out_of_range) return {nullptr, fmt::format("{} is not a finite number", text), "write a finite number"};
    if (!number.is_null()) return {std::move(number), "", ""};
  }
  return {text, "", ""};
}

}  // namespace kphi::profiles
