#include "fit/logs/layout_finding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/statistics.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/logs/role_finding.hpp"
#include "fit/logs/table_shape.hpp"

namespace kphi::fit {
namespace {

using SampleRows = std::vector<std::pair<std::size_t, std::vector<std::string>>>;  ///< line and fields

SampleRows rows_of(std::string_view text, const Layout& layout) {
  SampleRows rows;
  for (const TextLine& line : lines_of(text, std::string_view::npos)) {
    if (line.number < layout.first_row || (!layout.comment.empty() && line.comment == layout.comment)) continue;
    std::vector<std::string> fields = fields_of(line.text, layout.separator);
    if (fields.size() == layout.fields + 1 && fields.back().empty()) fields.pop_back();
    if (fields.size() == layout.fields) rows.emplace_back(line.number, std::move(fields));
  }
  return rows;
}

/// k by these rows, read with the format; 0 if they give none.
double k_of(const SampleRows& rows, const Layout& layout, const NumberFormat& format) {
  const auto thrust = layout.all(Role::thrust).front();
  const auto speeds = layout.has(Role::speed) ? layout.all(Role::speed) : layout.all(Role::electrical_speed);
  double products = 0, squares = 0;
  for (const auto& [line, fields] : rows) {
    const auto newtons = format.parse(fields[thrust.index]);
    double omega2 = 0;
    for (const LayoutColumn& speed : speeds) {
      const double rpm = format.parse(fields[speed.index]).value_or(0) * unit_named(Measure::speed, speed.unit)->factor;
      omega2 += square(from_rpm(rpm).value());
    }
    if (!newtons) continue;
    products += *newtons * unit_named(Measure::thrust, thrust.unit)->factor * omega2;
    squares += omega2 * omega2;
  }
  return squares > 0 ? std::abs(products / squares) : 0;
}

[[noreturn]] void ask_for_mark(const std::string& path, const SampleRows& rows, const Layout& layout,
                               const MarkEvidence& evidence) {
  const char mark = evidence.open_mark();
  const auto& [field, line] = evidence.either(mark);
  const NumberFormat point = evidence.format_with('.'), comma = evidence.format_with(',');
  refuse_at(path, line,
            fmt::format("\"{}\" can be {} or {}: no number of the table tells whether its \"{}\" is before decimals or "
                        "between thousands; k would be {:.2g} or {:.2g} N/(rad/s)^2; say which with --decimal point or "
                        "--decimal comma",
                        field, shortest(*point.parse(field)), shortest(*comma.parse(field)), mark,
                        k_of(rows, layout, point), k_of(rows, layout, comma)));
}

NumberFormat marks_of(const std::string& path, const SampleRows& rows, const Layout& layout, const LayoutHints& hints) {
  MarkEvidence evidence;
  for (const auto& [line, fields] : rows)
    for (const LayoutColumn& column : layout.columns)
      if (!is_text(column.role) && column.unit != "clock") evidence.add(fields[column.index], line);
  if (hints.decimal) return evidence.format_with(*hints.decimal);
  const auto format = evidence.format();
  if (!format) {
    const auto &point = evidence.decimal('.'), &comma = evidence.decimal(',');
    refuse_at(
        path, std::max(point.line, comma.line),
        point.line > 0 && comma.line > 0
            ? fmt::format("\"{}\" (line {}) has a decimal point and \"{}\" (line {}) a decimal comma; say which is "
                          "right with --decimal point or --decimal comma, or correct the file",
                          point.field, point.line, comma.field, comma.line)
            : "numbers of the table group their thousands in two ways; say which mark is before decimals with "
              "--decimal point or --decimal comma");
  }
  // Where a comma is the decimal mark, nobody separates fields by bare commas.
  const bool by_separator = layout.separator == ',' && evidence.open_mark() == '.';
  if (evidence.open_mark() != '\0' && !by_separator) ask_for_mark(path, rows, layout, evidence);
  return *format;
}

/// Of a throttle without one: µs from 900 to 2200, a share up to 1, percent up to 100; empty: none of these surely.
std::string throttle_unit(const SampleRows& rows, const LayoutColumn& column, const NumberFormat& format) {
  double lowest = 1e300, highest = -1e300;
  bool fraction = false;
  for (const auto& [line, fields] : rows) {
    const auto value = format.parse(fields[column.index]);
    if (!value) continue;
    lowest = std::min(lowest, *value), highest = std::max(highest, *value);
    fraction = fraction || *value != std::floor(*value);
  }
  if (lowest >= 900 && highest <= 2200 && highest > 1050) return "us";
  if (lowest >= 0 && highest > 1.5 && highest <= 100 && highest >= 20) return "%";
  return lowest >= 0 && highest <= 1 && fraction && highest > 0.2 ? "0..1" : "";
}

}  // namespace

Layout layout_of(const TableShape& shape, const std::vector<TextLine>& lines) {
  Layout layout;
  layout.separator = shape.separator;
  layout.fields = shape.fields;
  layout.header = shape.names;
  layout.header_line = shape.header ? lines[*shape.header].number : 0;
  layout.units_line = shape.units ? lines[*shape.units].number : 0;
  const std::size_t above = std::max(layout.header_line, layout.units_line);
  layout.first_row = above > 0 ? above + 1 : lines[shape.first].number;
  for (const TextLine& line : lines)
    if (layout.comment.empty() && line.number != layout.units_line) layout.comment = line.comment;
  return layout;
}

Layout find_layout(std::string_view begin, const std::string& path, const LayoutHints& hints) {
  const std::vector<TextLine> lines = lines_of(begin, kLinesLooked);
  const TableShape shape = find_shape(lines, path, hints.separator);
  Layout layout = layout_of(shape, lines);
  find_roles(path, lines, shape, hints.columns, layout);
  const SampleRows rows = rows_of(begin, layout);
  layout.numbers = marks_of(path, rows, layout, hints);
  for (LayoutColumn& column : layout.columns) {
    if (column.role != Role::throttle || !column.unit.empty()) continue;
    column.unit = throttle_unit(rows, column, layout.numbers);
    if (column.unit.empty())
      layout.unread.push_back(
          fmt::format("column {}: a throttle in no known unit; --column 'throttle={}:UNIT' reads it",
                      in_quotes(column.name), column.name));
  }
  std::erase_if(layout.columns,
                [](const auto& column) { return column.role == Role::throttle && column.unit.empty(); });
  return layout;
}

}  // namespace kphi::fit
