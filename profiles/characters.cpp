#include "profiles/characters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

namespace kphi::profiles {
namespace {

bool is_continuation(unsigned char byte) { return (byte & 0xC0u) == 0x80u; }

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
    if (!is_continuation(byte(i))) return 0;
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
  const auto column = std::count_if(text.begin() + static_cast<std::ptrdiff_t>(line_begin),
                                    text.begin() + static_cast<std::ptrdiff_t>(offset),
                                    [](char c) { return !is_continuation(static_cast<unsigned char>(c)); });
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
  const auto column = std::count_if(text.begin(), text.begin() + bytes,
                                    [](char c) { return !is_continuation(static_cast<unsigned char>(c)); });
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

std::optional<Finding> first_fault_of_characters(const std::string& text) {
  if (const auto bad = first_bad_character(text)) {
    return Finding{mark_of(text, bad->offset), "", bad->what, "save the file as UTF-8 text"};
  }
  if (const auto tab = first_tab_in_indentation(text)) {
    return Finding{mark_of(text, *tab), "", "a tab in the indentation", "indent with spaces"};
  }
  return std::nullopt;
}

}  // namespace kphi::profiles
