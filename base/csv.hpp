// A small strict reader of tables: comma separated or separated by blanks, one header line, numbers in from_chars'
// form. Whatever the bytes are, it does not throw: a line that does not fit the header is left out and reported.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/text.hpp"

namespace kphi {

struct TableRow {
  std::size_t line = 0;  ///< in the file, 1-based
  std::vector<std::string> fields;
};

/// The same in the text that is read, while it is there.
struct RowView {
  std::size_t line = 0;
  std::span<const std::string_view> fields;
};

struct TableProblem {
  std::size_t line = 0;
  std::string what;
};

struct Table {
  std::string path;  ///< only for messages
  std::size_t header_line = 0;
  std::vector<std::string> header;
  std::vector<TableRow> rows;  ///< every row has as many fields as the header
  std::vector<TableProblem> problems;

  /// Index of the column named exactly so. Throws ConfigurationError (path:line) if it is missing or given twice.
  [[nodiscard]] std::size_t column(std::string_view name) const;
  [[nodiscard]] std::optional<std::size_t> find_column(std::string_view name) const;
};

/// A byte order mark, CRLF and a trailing empty field on each line are accepted; a field may be in double quotes, a
/// quote in it doubled. Empty lines are skipped. Separator 0: the one of , ; tab that the header line has most of.
/// With `take` each row is handed over, with the table so far, and not kept.
using TakeRow = std::function<void(const Table&, const RowView&)>;
[[nodiscard]] Table read_csv(TextBlocks text, std::string path, char separator = ',', const TakeRow& take = {});

/// Rows of a block of whole lines of a table that is known by `begin`, its header and path; `line`: the number of the
/// first one. Skips lines that begin with `comment`, if there is one. What it returns holds the problems of the block.
[[nodiscard]] Table read_csv_rows(const Table& begin, std::string_view block, std::size_t line, char separator,
                                  const TakeRow& take, std::string_view comment = {});

/// , ; or tab: the one that the header line has most of.
[[nodiscard]] char likely_separator(std::string_view text);

/// The fields of one line of such a table, ' ' being any number of blanks and tabs; nullopt if its quotes do not close,
/// or text follows a closing quote.
[[nodiscard]] std::optional<std::vector<std::string>> split_csv_line(std::string_view line, char separator = ',');
/// Separated by blanks or tabs.
[[nodiscard]] Table read_blank_separated(TextBlocks text, std::string path);

/// The whole field as a finite number, blanks around it allowed; nullopt otherwise.
[[nodiscard]] std::optional<double> parse_number(std::string_view field);

}  // namespace kphi
