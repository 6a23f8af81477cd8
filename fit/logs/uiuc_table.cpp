#include "fit/logs/uiuc_table.hpp"

#include <fmt/format.h>

#include <cctype>
#include <filesystem>
#include <limits>

#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr double kMetresPerInch = 0.0254;
constexpr double kDiameterMaxIn = 60;
constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

bool part_of_number(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.'; }

}  // namespace

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
  const std::size_t rpm_column = table.column("RPM");
  const std::size_t ct_column = table.column("CT");
  const std::filesystem::path file(table.path);
  const auto diameter_in = options.diameter_in ? options.diameter_in : diameter_from_name(file.filename().string());
  if (!diameter_in) {
    throw ConfigurationError(
        fmt::format("{}:1: no diameter in the file's name; give it with --diameter-in", table.path));
  }
  const double diameter = *diameter_in * kMetresPerInch;

  ImportedTable imported;
  imported.unit = fmt::format("CT, rho {} kg/m3, D {} in", options.density_kg_m3, *diameter_in);
  imported.speed_source = "table";
  imported.rows_total = table.rows.size() + table.problems.size();
  imported.problems = table.problems;
  for (const TableRow& row : table.rows) {
    const auto rpm = parse_number(row.fields[rpm_column]);
    const auto ct = parse_number(row.fields[ct_column]);
    if (!rpm || !ct || !(*rpm > 0)) {
      imported.problems.push_back({row.line, "RPM or CT is no number above 0; the line is left out"});
      continue;
    }
    const double turns_per_s = *rpm / 60;
    results::StepMean step;
    step.propeller = file.stem().string();
    step.diameter_in = *diameter_in;
    step.repetition = 1;
    step.step = static_cast<int>(imported.steps.size());
    step.speed_rad_s = from_rpm(*rpm).value();
    step.speed_n = 1;
    step.thrust_n = *ct * options.density_kg_m3 * turns_per_s * turns_per_s * diameter * diameter * diameter * diameter;
    step.thrust_samples = 1;
    step.speed_sd_rad_s = step.thrust_sd_n = step.torque_nm = step.torque_sd_nm = kNotMeasured;
    step.supply_voltage_v = step.supply_current_a = step.motor_current_a = step.coil_temperature_degc = kNotMeasured;
    imported.steps.push_back(std::move(step));
    imported.lines.push_back(row.line);
  }
  if (imported.steps.empty()) throw ConfigurationError(fmt::format("{}:1: no row with a speed above 0", table.path));
  refuse_reversed_thrust(imported.steps, table.path);
  return imported;
}

}  // namespace kphi::fit
