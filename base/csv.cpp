#include "base/csv.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "base/number.hpp"

namespace kphi {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
constexpr std::string_view kBlanks = " \t";

std::string_view trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

/// Takes the next line off the front of `rest`, without its end.
std::string_view next_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// The quoted field at the front of `rest`; nullopt if its closing quote is missing.
std::optional<std::string> take_quoted(std::string_view& rest) {
  std::string field;
  for (std::size_t i = 1; i < rest.size(); ++i) {
    if (rest[i] != '"') {
      field += rest[i];
    } else if (i + 1 < rest.size() && rest[i + 1] == '"') {
      field += rest[i++];
    } else {
      rest.remove_prefix(i + 1);
      return field;
    }
  }
  return std::nullopt;
}

std::optional<std::vector<std::string>> split_blanks(std::string_view line) {
  std::vector<std::string> fields;
  while (!(line = trimmed(line)).empty()) {
    const std::size_t end = std::min(line.find_first_of(kBlanks), line.size());
    fields.emplace_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return fields;
}

/// A row with the header's number of fields, a trailing empty one taken off; otherwise the problem goes into the table.
void take_row(Table& table, std::size_t number, std::optional<std::vector<std::string>> fields, const TakeRow& take) {
  if (!fields) {
    table.problems.push_back({number, "a quoted field is not closed; line skipped"});
    return;
  }
  if (fields->size() == table.header.size() + 1 && fields->back().empty()) fields->pop_back();
  if (fields->size() != table.header.size()) {
    table.problems.push_back(
        {number, fmt::format("{} fields where the header has {}; line skipped", fields->size(), table.header.size())});
    return;
  }
  if (take) return take(table, {number, std::move(*fields)});
  table.rows.push_back({number, std::move(*fields)});
}

Table read_table(std::string_view text, std::string path, const auto& split, const TakeRow& take = {}) {
  Table table;
  table.path = std::move(path);
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  for (std::size_t number = 1; !text.empty(); ++number) {
    const std::string_view line = next_line(text);
    if (trimmed(line).empty()) continue;
    auto fields = split(line);
    if (table.header_line != 0) {
      take_row(table, number, std::move(fields), take);
      continue;
    }
    table.header_line = number;
    if (!fields) {
      table.problems.push_back({number, "a quoted field of the header is not closed"});
      return table;
    }
    table.header = std::move(*fields);
    if (table.header.size() > 1 && table.header.back().empty()) table.header.pop_back();
  }
  return table;
}

char likely_separator(std::string_view text) {
  const std::string_view header = next_line(text);
  char likely = ',';
  for (const char candidate : {';', '\t'})
    if (std::ranges::count(header, candidate) > std::ranges::count(header, likely)) likely = candidate;
  return likely;
}

}  // namespace

std::optional<std::size_t> Table::find_column(std::string_view name) const {
  const auto found = std::ranges::find(header, name);
  if (found == header.end()) return std::nullopt;
  return static_cast<std::size_t>(found - header.begin());
}

std::size_t Table::column(std::string_view name) const {
  const auto times = std::ranges::count(header, name);
  if (times == 1) return *find_column(name);
  throw ConfigurationError(fmt::format("{}:{}: {} column \"{}\"", path, std::max<std::size_t>(header_line, 1),
                                       times == 0 ? "no" : "more than one", name));
}

std::optional<std::vector<std::string>> split_csv_line(std::string_view line, char separator) {
  std::vector<std::string> fields;
  fields.reserve(static_cast<std::size_t>(std::ranges::count(line, separator)) + 1);
  for (;;) {
    if (!line.empty() && line.front() == '"') {
      auto field = take_quoted(line);
      if (!field || (!line.empty() && line.front() != separator)) return std::nullopt;
      fields.push_back(std::move(*field));
    } else {
      const std::size_t end = std::min(line.find(separator), line.size());
      fields.emplace_back(trimmed(line.substr(0, end)));
      line.remove_prefix(end);
    }
    if (line.empty()) return fields;
    line.remove_prefix(1);
  }
}

Table read_csv(std::string_view text, std::string path, char separator, const TakeRow& take) {
  if (separator == 0) separator = likely_separator(text);
  return read_table(
      text, std::move(path), [separator](std::string_view line) { return split_csv_line(line, separator); }, take);
}

Table read_blank_separated(std::string_view text, std::string path) {
  return read_table(text, std::move(path), split_blanks);
}

std::optional<double> parse_number(std::string_view field) { return parse_finite(trimmed(field)); }

}  // namespace kphi
