// A flight log as a table of text: a decoded blackbox, an export of any ground station. Its shape and its numbers are
// found as those of a stand's table; what its columns are, a flight layout says.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "base/text.hpp"
#include "fit/flights/flight_series.hpp"
#include "fit/logs/layout_finding.hpp"
#include "fit/logs/other_formats.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kTableBlock = std::size_t{1} << 20;
constexpr std::size_t kNamesShown = 40;

/// Whole lines, 1 MiB at most.
std::string_view first_block(std::string_view text, const std::string& path, std::size_t line) {
  if (text.size() <= kTableBlock) return text;
  const std::size_t end = text.rfind('\n', kTableBlock - 1);
  if (end == std::string_view::npos)
    refuse_at(path, line, "a line of more than 1 MiB; check that this is the right file");
  return text.substr(0, end + 1);
}

std::string names_of(const Layout& table) {
  std::vector<std::string> names;
  for (const std::string& name : table.header)
    if (names.size() < kNamesShown) names.push_back(in_quotes(name));
  return fmt::format("{}{}", fmt::join(names, ", "), table.header.size() > kNamesShown ? ", …" : "");
}

std::size_t column_of(const Layout& table, const std::string& name, const std::string& path) {
  const auto found =
      std::ranges::find_if(table.header, [&](const std::string& one) { return bare(one) == bare(name); });
  if (found == table.header.end())
    refuse_at(path, table.header_line, fmt::format("no column {}; there are {}", in_quotes(name), names_of(table)));
  return static_cast<std::size_t>(found - table.header.begin());
}

NumberFormat marks_in(const std::vector<TextLine>& lines, const Layout& table, const std::vector<std::size_t>& columns,
                      const std::string& path, std::optional<char> told) {
  MarkEvidence evidence;
  for (const TextLine& line : lines) {
    const auto fields = fields_of(line.text, table.separator);
    if (line.number < table.first_row || fields.size() < table.fields) continue;
    for (const std::size_t column : columns) evidence.add(fields[column], line.number);
  }
  if (told) return evidence.format_with(*told);
  // Where a comma is the decimal mark, nobody separates fields by bare commas.
  const bool by_separator = table.separator == ',' && evidence.open_mark() == '.';
  auto format = evidence.format();
  if (!format || (evidence.open_mark() != '\0' && !by_separator))
    refuse_at(
        path, table.first_row,
        "numbers that can be read in two ways; say with `decimal: point` or `decimal: comma` in the flight layout "
        "which mark is before decimals");
  if (format->decimal == '\0') format->decimal = table.separator == ',' || format->grouping != '.' ? '.' : ',';
  return *format;
}

class FlightTableReader {
 public:
  FlightTableReader(std::string_view text, const std::string& path, const FlightLayout& layout)
      : text_(text), path_(path), series_(path, {}, layout) {
    const std::vector<TextLine> lines = lines_of(first_block(text, path, 1), kLinesLooked);
    table_ = layout_of(find_shape(lines, path, '\0'), lines);
    const auto time = std::ranges::find(layout.sources, FlightQuantity::time, &FlightSource::quantity);
    if (time == layout.sources.end())
      refuse_at(
          path, table_.header_line,
          fmt::format("a table needs a flight layout that says which column is the time, the force, …; there are {}",
                      names_of(table_)));
    time_ = *time;
    std::vector<std::size_t> columns{time_column_ = column_of(table_, time_.series, path)};
    for (const FlightSeries& series : series_.all()) columns.push_back(column_of(table_, series.source.series, path));
    table_.numbers = marks_in(lines, table_, columns, path, layout.decimal);
    columns_.assign(columns.begin() + 1, columns.end());
  }

  void read(FlightLog& log) {
    const Table begin{path_, table_.header_line, std::vector<std::string>(table_.fields), {}, {}};
    std::size_t line = 1;
    for (; line < table_.first_row && !text_.empty(); ++line)
      text_.remove_prefix(std::min(text_.find('\n'), text_.size() - 1) + 1);
    while (!text_.empty()) {
      const std::string_view block = first_block(text_, path_, line);
      const Table read = read_csv_rows(
          begin, block, line, table_.separator, [&](const Table&, const RowView& row) { take(row); }, table_.comment);
      for (const TableProblem& problem : read.problems) skip(problem.line, problem.what);
      line += static_cast<std::size_t>(std::ranges::count(block, '\n'));
      text_.remove_prefix(block.size());
    }
    if (skipped_ > 0)
      log.findings.push_back({Severity::warning,
                              fmt::format("{} lines are left out, the first one ({}): {}", skipped_,
                                          first_skipped_.line, first_skipped_.what),
                              ""});
    series_.move_to(log);
  }

 private:
  void take(const RowView& row) {
    const auto time = table_.numbers.parse(row.fields[time_column_]);
    if (!time) return skip(row.line, fmt::format("the time is {}", in_quotes(row.fields[time_column_])));
    const double time_s = *time * time_.factor + time_.offset;
    if (!start_s_) start_s_ = time_s;
    // An empty field is a quantity that is logged less often.
    for (std::size_t i = 0; i < columns_.size(); ++i)
      if (const auto value = table_.numbers.parse(row.fields[columns_[i]])) series_.add(i, time_s - *start_s_, *value);
  }

  void skip(std::size_t line, const std::string& what) {
    if (skipped_++ == 0) first_skipped_ = {line, what};
  }

  std::string_view text_;
  const std::string& path_;
  SeriesSet series_;
  Layout table_;
  FlightSource time_;
  std::size_t time_column_ = 0;
  std::vector<std::size_t> columns_;  ///< of the series
  std::optional<double> start_s_;
  std::size_t skipped_ = 0;
  TableProblem first_skipped_;
};

}  // namespace

void read_flight_table(std::string_view bytes, const std::string& path, const FlightLayout& layout, FlightLog& log) {
  log.format = "table";
  refuse_other_formats(bytes.substr(0, kTableBlock), path);
  std::string converted;
  if (const Encoding encoding = encoding_of(bytes.substr(0, kTableBlock)); encoding != Encoding::utf8) {
    for (TextBlocks blocks = as_utf8(bytes, encoding); !blocks.front().empty(); blocks.pop())
      converted += blocks.front();
    bytes = converted;
  }
  if (bytes.starts_with("\xEF\xBB\xBF")) bytes.remove_prefix(3);
  FlightTableReader(bytes, path, layout).read(log);
}

}  // namespace kphi::fit
