#include "base/csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>

#include "base/error.hpp"
#include "base/number.hpp"

namespace kphi {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

constexpr bool is_blank(char c) { return c == ' ' || c == '\t'; }

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Takes the next line off the front of `rest`, without its end.
std::string_view next_line(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  std::string_view line = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

/// The fields of one line, as views of it; what a doubled quote makes of a field is kept here.
class Fields {
 public:
  void clear() { views_.clear(), mended_ = 0; }
  void add(std::string_view field) { views_.push_back(field); }
  /// Room for a field that is not as it stands in the line, until the next clear().
  std::string& mended() {
    if (mended_ == texts_.size()) texts_.emplace_back();
    std::string& text = texts_[mended_++];
    text.clear();
    return text;
  }
  [[nodiscard]] const std::vector<std::string_view>& views() const { return views_; }
  void pop_back() { views_.pop_back(); }

 private:
  std::vector<std::string_view> views_;
  std::deque<std::string> texts_;  // which do not move
  std::size_t mended_ = 0;
};

/// The quoted field at the front of `rest`; false if its closing quote is missing.
bool take_quoted(std::string_view& rest, Fields& fields) {
  std::string* mended = nullptr;
  for (std::size_t i = 1, begin = 1; i < rest.size(); ++i) {
    if (rest[i] != '"') continue;
    const bool doubled = i + 1 < rest.size() && rest[i + 1] == '"';
    if (doubled && mended == nullptr) mended = &fields.mended();
    if (mended != nullptr) mended->append(rest.substr(begin, i - begin + (doubled ? 1 : 0)));
    if (doubled) {
      begin = ++i + 1;
      continue;
    }
    fields.add(mended != nullptr ? std::string_view(*mended) : rest.substr(1, i - 1));
    rest.remove_prefix(i + 1);
    return true;
  }
  return false;
}

bool split_blanks(std::string_view line, Fields& fields) {
  fields.clear();
  while (!(line = trimmed(line)).empty()) {
    const auto end = static_cast<std::size_t>(std::ranges::find_if(line, is_blank) - line.begin());
    fields.add(line.substr(0, end));
    line.remove_prefix(end);
  }
  return true;
}

/// The same; false if its quotes do not close, or text follows a closing quote.
bool split_separated(std::string_view line, char separator, Fields& fields) {
  fields.clear();
  for (;;) {
    if (!line.empty() && line.front() == '"') {
      if (!take_quoted(line, fields) || (!line.empty() && line.front() != separator)) return false;
    } else {
      const std::size_t end = std::min(line.find(separator), line.size());
      fields.add(trimmed(line.substr(0, end)));
      line.remove_prefix(end);
    }
    if (line.empty()) return true;
    line.remove_prefix(1);
  }
}

std::vector<std::string> kept(const Fields& fields) { return {fields.views().begin(), fields.views().end()}; }

/// A row with the header's number of fields, a trailing empty one taken off; otherwise the problem goes into the table.
void take_row(Table& table, std::size_t line, Fields& fields, const TakeRow& take) {
  if (fields.views().size() == table.header.size() + 1 && fields.views().back().empty()) fields.pop_back();
  if (fields.views().size() != table.header.size()) {
    table.problems.push_back({line, fmt::format("{} fields where the header has {}; line skipped",
                                                fields.views().size(), table.header.size())});
  } else if (take) {
    take(table, {line, fields.views()});
  } else {
    table.rows.push_back({line, kept(fields)});
  }
}

/// From lines to a table: first the header, then rows.
class TableReader {
 public:
  /// After `line` lines of a table that may have its header.
  TableReader(Table begin, std::size_t line, const TakeRow& take) : table_(std::move(begin)), take_(take) {
    line_ = line;
  }

  /// Of a block of whole lines.
  void read(std::string_view lines, const auto& split, std::string_view comment = {}) {
    while (!lines.empty() && !given_up_) {
      ++line_;
      const std::string_view line = next_line(lines), content = trimmed(line);
      if (content.empty() || (!comment.empty() && content.starts_with(comment))) continue;
      take_line(split(line, fields_));
    }
  }

  [[nodiscard]] Table table() && { return std::move(table_); }

 private:
  /// `closed`: the quotes of the line are.
  void take_line(bool closed) {
    if (table_.header_line == 0) {
      take_header(closed);
    } else if (closed) {
      take_row(table_, line_, fields_, take_);
    } else {
      table_.problems.push_back({line_, "a quoted field is not closed; line skipped"});
    }
  }

  void take_header(bool closed) {
    table_.header_line = line_;
    given_up_ = !closed;
    if (!closed) {
      table_.problems.push_back({line_, "a quoted field of the header is not closed"});
      return;
    }
    table_.header = kept(fields_);
    if (table_.header.size() > 1 && table_.header.back().empty()) table_.header.pop_back();
  }

  Table table_;
  std::size_t line_ = 0;
  Fields fields_;  ///< of the line at hand
  const TakeRow& take_;
  bool given_up_ = false;
};

Table read_table(TextBlocks text, std::string path, const auto& split, const TakeRow& take = {}) {
  Table begin;
  begin.path = std::move(path);
  TableReader reader(std::move(begin), 0, take);
  std::string_view block = text.front();
  if (block.starts_with(kByteOrderMark)) block.remove_prefix(kByteOrderMark.size());
  for (; !block.empty(); text.pop(), block = text.front()) reader.read(block, split);
  return std::move(reader).table();
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
  Fields fields;
  const bool closed = separator == ' ' ? split_blanks(line, fields) : split_separated(line, separator, fields);
  return closed ? std::optional(kept(fields)) : std::nullopt;
}

char likely_separator(std::string_view text) {
  const std::string_view header = next_line(text);
  char likely = ',';
  for (const char candidate : {';', '\t'})
    if (std::ranges::count(header, candidate) > std::ranges::count(header, likely)) likely = candidate;
  return likely;
}

Table read_csv(TextBlocks text, std::string path, char separator, const TakeRow& take) {
  if (separator == 0) separator = likely_separator(text.front());
  return read_table(
      std::move(text), std::move(path),
      [separator](std::string_view line, Fields& fields) { return split_separated(line, separator, fields); }, take);
}

Table read_csv_rows(const Table& begin, std::string_view block, std::size_t line, char separator, const TakeRow& take,
                    std::string_view comment) {
  TableReader reader({begin.path, begin.header_line, begin.header, {}, {}}, line - 1, take);
  if (separator == ' ') {
    reader.read(block, split_blanks, comment);
  } else {
    reader.read(
        block, [separator](std::string_view text, Fields& fields) { return split_separated(text, separator, fields); },
        comment);
  }
  return std::move(reader).table();
}

Table read_blank_separated(TextBlocks text, std::string path) {
  return read_table(std::move(text), std::move(path), split_blanks);
}

std::optional<double> parse_number(std::string_view field) { return parse_finite(trimmed(field)); }

}  // namespace kphi
