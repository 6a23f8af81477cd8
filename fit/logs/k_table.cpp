#include "fit/logs/k_table.hpp"

#include <fmt/format.h>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

double number(const Table& table, const TableRow& row, std::size_t column) {
  const auto value = parse_number(row.fields[column]);
  if (value && *value >= 0) return *value;
  throw ConfigurationError(fmt::format("{}:{}: {} is '{}'; expected a number, 0 or above", table.path, row.line,
                                       table.header[column], row.fields[column]));
}

}  // namespace

bool is_k_table(std::string_view text) {
  const Table header = read_csv(text.substr(0, text.find('\n')), "");
  return header.find_column("phi_deg") && (header.find_column("k") || header.find_column("k_n_per_rpm2"));
}

std::vector<LinePoint> read_k_table(std::string_view text, std::string path) {
  const Table table = read_csv(text, std::move(path));
  if (!table.problems.empty()) {
    throw ConfigurationError(
        fmt::format("{}:{}: {}", table.path, table.problems.front().line, table.problems.front().what));
  }
  const bool per_rpm = table.find_column("k_n_per_rpm2").has_value();
  const double unit = per_rpm ? from_newtons_per_rpm2(1).value() : 1;
  const std::size_t phi = table.column("phi_deg");
  const std::size_t k = table.column(per_rpm ? "k_n_per_rpm2" : "k");
  const auto error = table.find_column(per_rpm ? "u_k_n_per_rpm2" : "u_k");
  std::vector<LinePoint> points;
  for (const TableRow& row : table.rows) {
    const LinePoint point{number(table, row, phi), number(table, row, k) * unit,
                          error ? number(table, row, *error) * unit : 0};
    if (point.phi_deg >= 360)
      throw ConfigurationError(
          fmt::format("{}:{}: phi_deg is {}; it ends below 360", table.path, row.line, point.phi_deg));
    points.push_back(point);
  }
  return points;
}

}  // namespace kphi::fit
