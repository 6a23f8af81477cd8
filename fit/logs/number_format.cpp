#include "fit/logs/number_format.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "base/csv.hpp"

namespace kphi::fit {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Marks that are more than a byte: no-break, narrow no-break and thin blanks, the typographic apostrophe, the minus.
constexpr std::array<std::pair<std::string_view, char>, 5> kWideMarks{
    {{"\xC2\xA0", ' '}, {"\xE2\x80\xAF", ' '}, {"\xE2\x80\x89", ' '}, {"\xE2\x80\x99", '\''}, {"\xE2\x88\x92", '-'}}};

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

/// With one byte for each mark.
std::string plain(std::string_view field) {
  std::string text(trimmed(field));
  if (std::ranges::all_of(text, [](char c) { return static_cast<unsigned char>(c) < 0x80u; })) return text;
  for (const auto& [wide, mark] : kWideMarks)
    for (std::size_t at = text.find(wide); at != std::string::npos; at = text.find(wide, at))
      text.replace(at, wide.size(), 1, mark);
  return std::string(trimmed(text));
}

/// A number in its parts: "-1.234,5e3" → -, {1, 234, 5}, {. ,}, e3.
struct Parts {
  bool negative = false;
  std::vector<std::string_view> digits;  ///< between the marks, one more than these
  std::string marks;
  std::string_view exponent;  ///< with its e
};

std::optional<Parts> parts_of(std::string_view text) {
  Parts parts;
  if (!text.empty() && (text.front() == '-' || text.front() == '+')) {
    parts.negative = text.front() == '-';
    text.remove_prefix(1);
  }
  const std::size_t e = text.find_first_of("eE");
  if (e != std::string_view::npos) {
    parts.exponent = text.substr(e);
    text = text.substr(0, e);
    std::string_view power = parts.exponent.substr(1);
    if (!power.empty() && (power.front() == '-' || power.front() == '+')) power.remove_prefix(1);
    if (power.empty() || !std::ranges::all_of(power, is_digit)) return std::nullopt;
  }
  if (text.empty() || text.size() > 64) return std::nullopt;
  std::size_t begin = 0, digits = 0;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && is_digit(text[i])) {
      ++digits;
      continue;
    }
    if (i < text.size() && std::string_view(".,' ").find(text[i]) == std::string_view::npos) return std::nullopt;
    parts.digits.push_back(text.substr(begin, i - begin));
    if (i < text.size()) parts.marks += text[i];
    begin = i + 1;
  }
  if (digits == 0) return std::nullopt;
  return parts;
}

/// Thousands before `end` are grouped as they must be: the first group of one to three digits, the others of three.
bool grouped(const Parts& parts, std::size_t end) {
  if (parts.digits.front().empty() || parts.digits.front().size() > 3) return false;
  for (std::size_t i = 1; i < end; ++i)
    if (parts.digits[i].size() != 3) return false;
  return true;
}

/// Of digits with at most one decimal mark, exactly as from_chars reads them and in a third of its time: a whole number
/// below 10^15 over a power of ten is rounded once. nullopt for whatever else.
std::optional<double> short_number(std::string_view field, char decimal) {
  constexpr std::size_t kMostDigits = 15;
  constexpr std::array<double, kMostDigits + 1> kPowers{1e0, 1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                                        1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const bool negative = !field.empty() && field.front() == '-';
  if (negative) field.remove_prefix(1);
  if (field.empty() || field.size() > kMostDigits + 1) return std::nullopt;
  std::uint64_t whole = 0;
  std::size_t digits = 0, decimals = 0;
  bool marked = false;
  for (const char c : field) {
    if (is_digit(c)) {
      whole = 10 * whole + static_cast<std::uint64_t>(c - '0');
      ++digits, decimals += marked ? 1 : 0;
    } else if (c == decimal && !marked) {
      marked = true;
    } else {
      return std::nullopt;
    }
  }
  if (digits == 0 || digits > kMostDigits) return std::nullopt;
  const double value = static_cast<double>(whole) / kPowers[decimals];
  return negative ? -value : value;
}

}  // namespace

std::optional<double> NumberFormat::parse(std::string_view field) const {
  if (decimal != '\0')
    if (const auto value = short_number(field, decimal)) return value;
  if (decimal == '.')
    if (const auto value = parse_number(field)) return value;
  const std::string text = plain(field);
  const auto parts = parts_of(text);
  if (!parts || (decimal == '\0' && text.find_first_of(".,") != std::string::npos)) return std::nullopt;
  std::size_t groups = parts->digits.size();
  if (!parts->marks.empty() && parts->marks.back() == decimal) --groups;
  for (std::size_t i = 0; i + 1 < groups; ++i)
    if (parts->marks[i] != grouping || grouping == '\0') return std::nullopt;
  if (groups > 1 && !grouped(*parts, groups)) return std::nullopt;
  std::string number(parts->negative ? "-" : "");
  for (std::size_t i = 0; i < groups; ++i) number += parts->digits[i];
  if (groups < parts->digits.size()) number += "." + std::string(parts->digits.back());
  return parse_number(number + std::string(parts->exponent));
}

std::string NumberFormat::example() const {
  std::string text = grouping == '\0' ? "1234" : std::string("1") + grouping + "234";
  return decimal == '\0' ? text : text + decimal + "5";
}

bool looks_like_number(std::string_view field) {
  const std::string text = plain(field);
  const auto parts = parts_of(text);
  if (!parts) return false;
  // At most one decimal mark, the last; all before it one mark of grouping.
  if (parts->marks.size() < 2)
    return parts->marks.empty() || parts->marks.front() == '.' || parts->marks.front() == ',' || grouped(*parts, 2);
  for (std::size_t i = 1; i + 1 < parts->marks.size(); ++i)
    if (parts->marks[i] != parts->marks.front()) return false;
  const bool all_one = parts->marks.back() == parts->marks.front();
  return grouped(*parts, all_one ? parts->digits.size() : parts->digits.size() - 1);
}

void MarkEvidence::add(std::string_view field, std::size_t line) {
  if (std::ranges::all_of(field, is_digit)) return;
  const std::string text = plain(field);
  const auto parts = parts_of(text);
  if (!parts || parts->marks.empty() || !looks_like_number(text)) return;
  const auto note = [&](Witness& witness) {
    if (witness.line == 0) witness = {text, line};
  };
  const auto place = [](char mark) { return mark == ',' ? 1u : 0u; };
  const char first = parts->marks.front(), last = parts->marks.back();
  if (first == ' ' || first == '\'') note(first == ' ' ? blank_ : apostrophe_);
  if (first != last) {
    note(decimal_[place(last)]);
    if (first == '.' || first == ',') note(grouping_[place(first)]);
  } else if (first == '.' || first == ',') {
    const bool zero = parts->digits.front() == "0" || !parts->exponent.empty();
    if (parts->marks.size() > 1)
      note(grouping_[place(first)]);
    else if (grouped(*parts, 2) && !zero)
      note(either_[place(first)]);
    else
      note(decimal_[place(first)]);
  }
}

bool MarkEvidence::decimal_is(char mark) const {
  const char other = mark == '.' ? ',' : '.';
  return decimal(mark).line > 0 || grouping_[other == ',' ? 1 : 0].line > 0;
}

std::optional<NumberFormat> MarkEvidence::format() const {
  if (decimal_is('.') && decimal_is(',')) return std::nullopt;
  for (const char mark : {'.', ','})
    if (decimal(mark).line > 0 && grouping_[mark == ',' ? 1 : 0].line > 0) return std::nullopt;
  NumberFormat format;
  const bool point = decimal_is('.') || either('.').line > 0 || either(',').line > 0;
  format.decimal = decimal_is(',') ? ',' : point ? '.' : '\0';
  const char other = format.decimal == ',' ? '.' : ',';
  const bool told = decimal_is('.') || decimal_is(',');
  const bool other_groups = grouping_[other == ',' ? 1 : 0].line > 0 || (told && either(other).line > 0);
  if ((other_groups ? 1 : 0) + (blank_.line > 0 ? 1 : 0) + (apostrophe_.line > 0 ? 1 : 0) > 1) return std::nullopt;
  format.grouping = other_groups ? other : blank_.line > 0 ? ' ' : apostrophe_.line > 0 ? '\'' : '\0';
  return format;
}

NumberFormat MarkEvidence::format_with(char decimal) const {
  const std::size_t other = decimal == '.' ? 1 : 0;
  const bool grouped_by_other = grouping_[other].line > 0 || either_[other].line > 0;
  const char mark = grouped_by_other       ? (other == 1 ? ',' : '.')
                    : blank_.line > 0      ? ' '
                    : apostrophe_.line > 0 ? '\''
                                           : '\0';
  return {decimal, mark};
}

char MarkEvidence::open_mark() const {
  if (decimal_is('.') || decimal_is(',')) return '\0';
  return either(',').line > 0 ? ',' : either('.').line > 0 ? '.' : '\0';
}

}  // namespace kphi::fit
