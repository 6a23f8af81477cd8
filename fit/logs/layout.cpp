#include "fit/logs/layout.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <memory>

#include "profiles/profile_reader.hpp"

namespace kphi::fit {
namespace {

template <class Value>
struct Word {
  Value value;
  const char* word;
};

constexpr std::array<Word<Encoding>, 4> kEncodings{{{Encoding::utf8, "utf-8"},
                                                    {Encoding::utf16le, "utf-16le"},
                                                    {Encoding::utf16be, "utf-16be"},
                                                    {Encoding::windows1252, "windows-1252"}}};
constexpr std::array<Word<char>, 5> kSeparators{
    {{',', "comma"}, {';', "semicolon"}, {'\t', "tab"}, {'|', "bar"}, {' ', "blanks"}}};
constexpr std::array<Word<char>, 3> kDecimals{{{'.', "point"}, {',', "comma"}, {'\0', "none"}}};
constexpr std::array<Word<char>, 5> kGroupings{
    {{'\0', "none"}, {'.', "point"}, {',', "comma"}, {' ', "blank"}, {'\'', "apostrophe"}}};

template <class Words, class Value>
const char* word_of(const Words& words, Value value) {
  return std::ranges::find(words, value, &Words::value_type::value)->word;
}

template <class Words>
auto value_of(const Words& words, const std::string& word) {
  return std::ranges::find_if(words, [&](const auto& one) { return word == one.word; })->value;
}

void append_utf8(std::string& text, std::uint32_t c) {
  const auto byte = [&](std::uint32_t value) { text += static_cast<char>(value); };
  if (c < 0x80u) {
    byte(c);
  } else if (c < 0x800u) {
    byte(0xC0u | (c >> 6u));
    byte(0x80u | (c & 0x3Fu));
  } else if (c < 0x10000u) {
    byte(0xE0u | (c >> 12u));
    byte(0x80u | ((c >> 6u) & 0x3Fu));
    byte(0x80u | (c & 0x3Fu));
  } else {
    byte(0xF0u | (c >> 18u));
    byte(0x80u | ((c >> 12u) & 0x3Fu));
    byte(0x80u | ((c >> 6u) & 0x3Fu));
    byte(0x80u | (c & 0x3Fu));
  }
}

/// Takes pieces of another encoding and gives whole lines of UTF-8.
class Converter {
 public:
  Converter(TextBlocks text, Encoding encoding, bool old_mac)
      : text_(std::move(text)), encoding_(encoding), old_mac_(old_mac) {}

  std::string_view next() {
    given_.clear();
    while (given_.empty() && !text_.front().empty()) {
      convert(text_.front());
      text_.pop();
      const std::size_t end = text_.front().empty() ? converted_.size() : converted_.rfind('\n') + 1;
      given_.assign(converted_, 0, end);
      converted_.erase(0, end);
    }
    return given_;
  }

 private:
  void convert(std::string_view bytes) {
    if (encoding_ == Encoding::windows1252 || encoding_ == Encoding::utf8) {
      for (const char c : bytes) {
        const auto code = static_cast<unsigned char>(c);
        if (old_mac_ && c == '\r')
          converted_ += '\n';
        else if (encoding_ == Encoding::utf8)
          converted_ += c;
        else
          append_utf8(converted_, code >= 0x91u && code <= 0x92u ? 0x2019u : code == 0x80u ? 0x20ACu : code);
      }
      return;
    }
    left_ += bytes;
    const std::size_t low = encoding_ == Encoding::utf16le ? 0 : 1;
    std::size_t at = 0;
    const auto unit = [&](std::size_t i) {
      return std::uint32_t{static_cast<unsigned char>(left_[i + low])} |
             std::uint32_t{static_cast<unsigned char>(left_[i + 1 - low])} << 8u;
    };
    for (; at + 2 <= left_.size(); at += 2) {
      std::uint32_t c = unit(at);
      if (c >= 0xD800u && c < 0xDC00u) {
        if (at + 4 > left_.size()) break;
        c = 0x10000u + ((c - 0xD800u) << 10u) + ((unit(at + 2) - 0xDC00u) & 0x3FFu);
        at += 2;
      }
      append_utf8(converted_, c);
    }
    left_.erase(0, at);
  }

  TextBlocks text_;
  Encoding encoding_;
  bool old_mac_;
  std::string left_, converted_, given_;
};

bool valid_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = static_cast<unsigned char>(text[i++]);
    const int more = lead < 0x80u              ? 0
                     : (lead & 0xE0u) == 0xC0u ? 1
                     : (lead & 0xF0u) == 0xE0u ? 2
                     : (lead & 0xF8u) == 0xF0u ? 3
                                               : -1;
    if (more < 0) return false;
    for (int k = 0; k < more; ++k, ++i)
      if (i >= text.size() || !profiles::is_continuation(text[i])) return false;
  }
  return true;
}

std::string column_words(const LayoutColumn& column) {
  std::string words = fmt::format("column {}", column.index + 1);
  if (!column.name.empty()) words += " " + in_quotes(column.name);
  return column.unit.empty() ? words : words + " in " + column.unit;
}

std::string quoted_yaml(const std::string& text) {
  std::string quoted = "'";
  for (const char c : printable(text)) quoted += c == '\'' ? "''" : std::string(1, c);
  return quoted + "'";
}

std::size_t whole(const profiles::ProfileReader& file, const std::string& pointer) {
  return static_cast<std::size_t>(file.get<int>(pointer));
}

LayoutColumn read_column(profiles::ProfileReader& file, const std::string& at) {
  LayoutColumn column;
  column.role = *role_named(file.text(at + "/role"));
  column.index = whole(file, at + "/column") - 1;
  column.name = file.get_or<std::string>(at + "/name", "");
  column.unit = file.get_or<std::string>(at + "/unit", "");
  const Measure measure = measure_of(column.role);
  if (!unit_named(measure, column.unit))
    file.refuse(at + (column.unit.empty() ? "" : "/unit"), "no unit of " + std::string(name_of(column.role)),
                "known are " + unit_list(measure));
  return column;
}

}  // namespace

std::vector<LayoutColumn> Layout::all(Role role) const {
  std::vector<LayoutColumn> found;
  std::ranges::copy_if(columns, std::back_inserter(found), [&](const auto& column) { return column.role == role; });
  return found;
}

std::size_t Layout::rotors() const { return std::max<std::size_t>(1, all(Role::speed).size()); }

TextBlocks as_utf8(TextBlocks text, Encoding encoding) {
  const bool old_mac =
      text.front().find('\r') != std::string_view::npos && text.front().find('\n') == std::string_view::npos;
  if (encoding == Encoding::utf8 && !old_mac) return text;
  const std::size_t bytes = text.bytes();
  auto converter = std::make_shared<Converter>(std::move(text), encoding, old_mac);
  return {[converter] { return converter->next(); }, bytes};
}

Encoding encoding_of(std::string_view text) {
  if (text.starts_with("\xFF\xFE")) return Encoding::utf16le;
  if (text.starts_with("\xFE\xFF")) return Encoding::utf16be;
  const std::string_view begin = text.substr(0, 4096);
  std::size_t nul[2]{};
  for (std::size_t i = 0; i < begin.size(); ++i) nul[i % 2] += begin[i] == '\0' ? 1 : 0;
  // Text of a western language: nearly every character below 256.
  for (const std::size_t place : {1u, 0u})
    if (10 * nul[place] > 4 * begin.size() && nul[1 - place] == 0)
      return place == 1 ? Encoding::utf16le : Encoding::utf16be;
  return valid_utf8(text) ? Encoding::utf8 : Encoding::windows1252;
}

std::string describe(const Layout& layout) {
  std::string text;
  const auto line = [&](const char* what, const std::string& words) {
    text += fmt::format("  {:<12} {}\n", what, words);
  };
  const std::string header = layout.header_line == 0 ? "no names" : fmt::format("names in line {}", layout.header_line);
  line("lines",
       header + (layout.units_line > 0 ? fmt::format(", units in line {}", layout.units_line) : "") +
           fmt::format(", rows from line {}", layout.first_row) +
           (layout.comment.empty() ? "" : fmt::format(", comments begin with {}", layout.comment)) +
           (layout.encoding == Encoding::utf8 ? "" : fmt::format(", {}", word_of(kEncodings, layout.encoding))));
  line("fields", fmt::format("{}, separated by {}; numbers such as {}", layout.fields,
                             word_of(kSeparators, layout.separator), layout.numbers.example()));
  std::vector<std::string> groups;
  for (const LayoutColumn& column : layout.columns) {
    if (is_text(column.role))
      groups.push_back(name_of(column.role) + std::string(", ") + column_words(column));
    else
      line(name_of(column.role), column_words(column));
  }
  if (!groups.empty()) line("groups", fmt::format("{}", fmt::join(groups, "; ")));
  if (layout.rotors() > 1) line("rotors", fmt::format("{}: thrust is that of all, k that of one", layout.rotors()));
  for (const std::string& one : layout.unread) line("not read", printable(one));
  return text;
}

std::string layout_text(const Layout& layout) {
  std::string text = fmt::format(
      "format: kphi-layout/1\n"
      "# How a table of a stand is written. Lines and columns count from 1; 0: the table has no such line.\n"
      "encoding: {}\nheader_line: {}\nunits_line: {}\nfirst_row: {}\nfields: {}\ncomment: {}\nseparator: {}\n"
      "decimal: {}     # the mark before the decimals\ngrouping: {}     # the mark between thousands\n"
      "# Two speeds and more are those of as many rotors; the thrust is then that of all of them.\ncolumns:\n",
      word_of(kEncodings, layout.encoding), layout.header_line, layout.units_line, layout.first_row, layout.fields,
      quoted_yaml(layout.comment), word_of(kSeparators, layout.separator), word_of(kDecimals, layout.numbers.decimal),
      word_of(kGroupings, layout.numbers.grouping));
  for (const LayoutColumn& column : layout.columns)
    text += fmt::format("  - {{role: {}, column: {}, name: {}, unit: {}}}\n", name_of(column.role), column.index + 1,
                        quoted_yaml(column.name), quoted_yaml(column.unit));
  return text;
}

Layout parse_layout(const std::string& text, const std::string& path) {
  profiles::ProfileReader file(text, path, profiles::FileKind::layout);
  Layout layout;
  layout.encoding = value_of(kEncodings, file.text("/encoding"));
  layout.header_line = whole(file, "/header_line");
  layout.units_line = whole(file, "/units_line");
  layout.first_row = whole(file, "/first_row");
  layout.fields = whole(file, "/fields");
  layout.comment = file.text("/comment");
  layout.separator = value_of(kSeparators, file.text("/separator"));
  layout.numbers = {value_of(kDecimals, file.text("/decimal")), value_of(kGroupings, file.text("/grouping"))};
  for (std::size_t i = 0; file.has(fmt::format("/columns/{}", i)); ++i)
    layout.columns.push_back(read_column(file, fmt::format("/columns/{}", i)));
  if (layout.numbers.decimal == layout.numbers.grouping && layout.numbers.decimal != '\0')
    file.refuse("/grouping", "the same mark as decimal", "name another one, or none");
  if (layout.first_row <= std::max(layout.header_line, layout.units_line))
    file.refuse("/first_row", "before the line of names or units", "name the line of the first row of numbers");
  if (!layout.has(Role::thrust) || !(layout.has(Role::speed) || layout.has(Role::electrical_speed)))
    file.refuse("/columns", "no column of thrust, or none of a speed", "name both");
  for (const LayoutColumn& column : layout.columns) {
    if (column.index >= layout.fields)
      file.refuse("/fields", "fewer than the columns named", "name the fields of a row");
    if (column.role != Role::speed && layout.all(column.role).size() > 1)
      file.refuse("/columns", fmt::format("two columns of {}", name_of(column.role)), "name one");
  }
  file.finish();
  return layout;
}

}  // namespace kphi::fit
