#include "fit/logs/coefficient_table.hpp"

#include <fmt/format.h>

#include <cctype>
#include <cmath>
#include <filesystem>

#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr double kMetresPerInch = 0.0254;
constexpr double kDiameterMaxIn = 60;

bool part_of_number(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.'; }

double non_negative(const Table& table, const TableRow& row, std::size_t column) {
  const auto value = parse_number(row.fields[column]);
  if (value && *value >= 0) return *value;
  throw ConfigurationError(fmt::format("{}:{}: {} is \"{}\"; expected a number, 0 or above", table.path, row.line,
                                       table.header[column], row.fields[column]));
}

std::string_view first_line(std::string_view text) { return text.substr(0, text.find('\n')); }

}  // namespace

bool is_uiuc(std::string_view text) {
  const Table header = read_blank_separated(first_line(text), "");
  return header.find_column("RPM") && header.find_column("CT");
}

std::optional<double> diameter_from_name(std::string_view file_name) {
  for (std::size_t x = file_name.find('x', 1); x != std::string_view::npos; x = file_name.find('x', x + 1)) {
    if (x + 1 >= file_name.size() || !part_of_number(file_name[x + 1])) continue;
    std::size_t begin = x;
    while (begin > 0 && part_of_number(file_name[begin - 1])) --begin;
    const auto diameter = parse_number(file_name.substr(begin, x - begin));
    if (diameter && *diameter > 0 && *diameter <= kDiameterMaxIn) return diameter;
  }
  return std::nullopt;
}

ImportedTable read_uiuc(std::string_view text, std::string path, const UiucOptions& options) {
  const Table table = read_blank_separated(text, std::move(path));
  const std::size_t rpm_column = table.column("RPM"), ct_column = table.column("CT");
  const std::filesystem::path file(table.path);
  const auto diameter_in = options.diameter_in ? options.diameter_in : diameter_from_name(file.filename().string());
  if (!diameter_in)
    throw ConfigurationError(fmt::format("{}:1: no diameter in the file's name; give --diameter-in", table.path));
  ImportedTable imported;
  imported.unit = fmt::format("CT, rho {} kg/m3, D {} in", options.density_kg_m3, *diameter_in);
  imported.speed_source = "table";
  imported.rows_total = table.rows.size() + table.problems.size();
  imported.problems = table.problems;
  for (const TableRow& row : table.rows) {
    const auto rpm = parse_number(row.fields[rpm_column]), ct = parse_number(row.fields[ct_column]);
    if (!rpm || !ct || !(*rpm > 0)) {
      imported.problems.push_back({row.line, "RPM or CT is not a number above 0; line skipped"});
      continue;
    }
    const double turns_per_s = *rpm / 60, diameter = *diameter_in * kMetresPerInch;
    results::StepMean step =
        step_of_row(*rpm, *ct * options.density_kg_m3 * turns_per_s * turns_per_s * std::pow(diameter, 4));
    step.propeller = file.stem().string();
    step.diameter_in = *diameter_in;
    step.step = static_cast<int>(imported.steps.size());
    imported.steps.push_back(std::move(step));
    imported.lines.push_back(row.line);
  }
  if (imported.steps.empty()) throw ConfigurationError(fmt::format("{}:1: no row with a speed above 0", table.path));
  refuse_reversed_thrust(imported.steps, table.path);
  return imported;
}

bool is_k_table(std::string_view text) {
  const Table header = read_csv(first_line(text), "");
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
  const std::size_t phi = table.column("phi_deg"), k = table.column(per_rpm ? "k_n_per_rpm2" : "k");
  const auto error = table.find_column(per_rpm ? "u_k_n_per_rpm2" : "u_k");
  std::vector<LinePoint> points;
  for (const TableRow& row : table.rows) {
    points.push_back({non_negative(table, row, phi), non_negative(table, row, k) * unit,
                      error ? non_negative(table, row, *error) * unit : 0});
    if (points.back().phi_deg >= 360) {
      throw ConfigurationError(
          fmt::format("{}:{}: phi_deg is {}; it must be below 360", table.path, row.line, points.back().phi_deg));
    }
  }
  return points;
}

}  // namespace kphi::fit
