#include "profiles/yaml_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <string_view>
#include <tuple>
#include <utility>

namespace kphi::profiles {
namespace {

/// Bytes of the UTF-8 sequence at `offset`, 0 if it is broken, overlong, a surrogate or beyond U+10FFFF.
std::size_t sequence_length(const std::string& text, std::size_t offset) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[offset + i]); };
  const unsigned char first = byte(0);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xC2 ? 0
                             : first < 0xE0 ? 2
                             : first < 0xF0 ? 3
                             : first < 0xF5 ? 4
                                            : 0;
  if (length == 0 || offset + length > text.size()) return 0;
  for (std::size_t i = 1; i < length; ++i) {
    if (!is_continuation(text[offset + i])) return 0;
  }
  if (length < 3) return length;
  const bool overlong = (first == 0xE0 && byte(1) < 0xA0) || (first == 0xF0 && byte(1) < 0x90);
  const bool no_character = (first == 0xED && byte(1) > 0x9F) || (first == 0xF4 && byte(1) > 0x8F);
  return overlong || no_character ? 0 : length;
}

bool is_control(const std::string& text, std::size_t offset) {
  const auto c = static_cast<unsigned char>(text[offset]);
  if (c == '\r') return offset + 1 >= text.size() || text[offset + 1] != '\n';
  return (c < 0x20 && c != '\n' && c != '\t') || c == 0x7F;
}

Mark mark_of(const std::string& text, std::size_t offset) {
  const std::size_t line_begin = offset == 0 ? 0 : text.rfind('\n', offset - 1) + 1;  // npos + 1 == 0
  const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(offset), '\n');
  const auto column =
      std::count_if(text.begin() + static_cast<std::ptrdiff_t>(line_begin),
                    text.begin() + static_cast<std::ptrdiff_t>(offset), [](char c) { return !is_continuation(c); });
  return {static_cast<int>(line) + 1, static_cast<int>(column) + 1};
}

std::optional<std::size_t> first_tab_in_indentation(const std::string& text) {
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::size_t word = std::min(text.find_first_not_of(" \t\r", begin), end);
    const std::size_t tab = text.find('\t', begin);
    if (word < end && text[word] != '#' && tab < word) return tab;
    begin = end + 1;
  }
  return std::nullopt;
}

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

std::vector<FileFinding> in_file_order(std::vector<FileFinding> findings) {
  std::stable_sort(findings.begin(), findings.end(), [](const FileFinding& a, const FileFinding& b) {
    return std::tie(a.mark.line, a.mark.column) < std::tie(b.mark.line, b.mark.column);
  });
  return findings;
}

std::string describe_all(const std::string& path, const std::vector<FileFinding>& unordered) {
  const auto findings = in_file_order(unordered);
  std::string lines;
  for (std::size_t i = 0; i < std::min(findings.size(), RefusedFile::kShownFindings); ++i) {
    lines += (i == 0 ? "" : "\n") + describe(path, findings[i]);
  }
  if (findings.size() > RefusedFile::kShownFindings) {
    lines +=
        fmt::format("\n{}: {} more problems; fix these first", path, findings.size() - RefusedFile::kShownFindings);
  }
  return lines;
}

}  // namespace

Lines::Lines(const std::string& text) {
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    lines_.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
}

Mark Lines::mark(int line, int byte_column) const {
  const int last = static_cast<int>(lines_.size()) - 1;
  const std::string& text = lines_[static_cast<std::size_t>(std::clamp(line, 0, last))];
  const auto bytes = std::clamp<std::ptrdiff_t>(byte_column, 0, static_cast<std::ptrdiff_t>(text.size()));
  const auto column = std::count_if(text.begin(), text.begin() + bytes, [](char c) { return !is_continuation(c); });
  return {std::clamp(line, 0, last) + 1, static_cast<int>(column) + 1};
}

std::optional<BadCharacter> first_bad_character(const std::string& text) {
  std::size_t offset = 0;
  while (offset < text.size()) {
    const std::size_t length = sequence_length(text, offset);
    if (length == 0) return BadCharacter{offset, "a byte sequence that is not UTF-8"};
    if (is_control(text, offset)) {
      return BadCharacter{offset,
                          fmt::format("a control character (0x{:02x})", static_cast<unsigned char>(text[offset]))};
    }
    offset += length;
  }
  return std::nullopt;
}

std::optional<FileFinding> first_fault_of_characters(const std::string& text) {
  if (const auto bad = first_bad_character(text)) {
    return FileFinding{mark_of(text, bad->offset), "", bad->what, "save the file as UTF-8 text"};
  }
  if (const auto tab = first_tab_in_indentation(text)) {
    return FileFinding{mark_of(text, *tab), "", "a tab in the indentation", "indent with spaces"};
  }
  return std::nullopt;
}

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

std::string describe(const std::string& path, const FileFinding& finding) {
  return fmt::format("{}:{}:{}: {}", path, finding.mark.line, finding.mark.column, finding.words());
}

RefusedFile::RefusedFile(const std::string& path, std::vector<FileFinding> findings)
    : ConfigurationError(describe_all(path, findings)), findings_(in_file_order(std::move(findings))) {}

}  // namespace kphi::profiles
