#include "fit/rcbenchmark_csv.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>

#include "compensation/units.hpp"
#include "profiles/configuration_error.hpp"

namespace kphi::fit {
namespace {

struct ThrustUnit {
  std::string_view column;
  std::string_view unit;
  double newtons;
};

constexpr std::array<ThrustUnit, 3> kThrustUnits{{
    {"Thrust (gf)", "gf", from_gram_force(1).value()},
    {"Thrust (kgf)", "kgf", from_gram_force(1000).value()},
    {"Thrust (N)", "N", 1},
}};

constexpr double kNotMeasured = std::numeric_limits<double>::quiet_NaN();

[[noreturn]] void refuse(const std::string& path, std::size_t line, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:{}: {}", path, std::max<std::size_t>(line, 1), what));
}

const ThrustUnit& thrust_unit(const Table& table) {
  const ThrustUnit* found = nullptr;
  for (const ThrustUnit& unit : kThrustUnits) {
    if (!table.find_column(unit.column)) continue;
    if (found != nullptr) refuse(table.path, table.header_line, "two thrust columns with different units");
    found = &unit;
  }
  if (found != nullptr) return *found;
  for (const std::string& name : table.header) {
    if (name.starts_with("Thrust"))
      refuse(table.path, table.header_line, fmt::format("unit of column '{}' is none of gf, kgf, N", name));
  }
  refuse(table.path, table.header_line,
         "no column 'Thrust (gf)', 'Thrust (kgf)' or 'Thrust (N)': no RCbenchmark table");
}

/// The column if it is there; twice is refused.
std::optional<std::size_t> optional_column(const Table& table, std::string_view name) {
  if (!table.find_column(name)) return std::nullopt;
  return table.column(name);
}

std::optional<double> field(const TableRow& row, std::optional<std::size_t> column) {
  return column ? parse_number(row.fields[*column]) : std::nullopt;
}

std::optional<double> rpm_of(const RcbenchmarkRow& row, SpeedSource source) {
  return source == SpeedSource::electrical ? row.electrical_rpm : row.optical_rpm;
}

SpeedSource choose_speed(const RcbenchmarkLog& log, const RcbenchmarkSelection& selection) {
  const bool electrical_turns = std::any_of(
      log.rows.begin(), log.rows.end(), [](const RcbenchmarkRow& row) { return row.electrical_rpm.value_or(0) > 0; });
  const SpeedSource source =
      selection.speed.value_or(electrical_turns || !log.has_optical ? SpeedSource::electrical : SpeedSource::optical);
  if (source == SpeedSource::electrical && !log.has_electrical)
    refuse(log.path, 1, "no column 'Motor Electrical Speed (RPM)'; take the optical one (--speed optical)");
  if (source == SpeedSource::optical && !log.has_optical)
    refuse(log.path, 1, "no column 'Motor Optical Speed (RPM)'; take the electrical one (--speed electrical)");
  return source;
}

bool motor_off(const RcbenchmarkRow& row, SpeedSource source, double off_esc_us) {
  return row.esc_us && *row.esc_us <= off_esc_us && rpm_of(row, source).value_or(0) == 0;
}

double tare_of(const RcbenchmarkLog& log, const RcbenchmarkSelection& selection, SpeedSource source) {
  double sum = 0;
  std::size_t n = 0;
  for (const RcbenchmarkRow& row : log.rows) {
    if (n == selection.tare_rows) break;
    if (!motor_off(row, source, selection.off_esc_us)) continue;
    sum += row.thrust_n;
    ++n;
  }
  if (n < selection.tare_rows) {
    refuse(log.path, 1, fmt::format("{} rows with the motor off, {} are asked for the tare", n, selection.tare_rows));
  }
  return n == 0 ? 0 : sum / static_cast<double>(n);
}

bool is_point(const RcbenchmarkRow& row, const RcbenchmarkSelection& selection, SpeedSource source) {
  if (!(rpm_of(row, source).value_or(0) > selection.speed_above_rpm)) return false;
  if (selection.esc_above_us && !(row.esc_us.value_or(0) > *selection.esc_above_us)) return false;
  if (!selection.optical_per_electrical) return true;
  const double electrical = row.electrical_rpm.value_or(0);
  return electrical > 0 && std::abs(row.optical_rpm.value_or(0) / electrical - *selection.optical_per_electrical) <=
                               selection.ratio_tolerance;
}

}  // namespace

RcbenchmarkLog read_rcbenchmark(std::string_view text, std::string path) {
  const Table table = read_csv(text, std::move(path));
  const ThrustUnit& unit = thrust_unit(table);
  const std::size_t thrust = table.column(unit.column);
  const auto time = optional_column(table, "Time (s)");
  const auto esc_long = optional_column(table, "ESC signal (µs)");
  const auto esc = esc_long ? esc_long : optional_column(table, "ESC (µs)");
  const auto electrical = optional_column(table, "Motor Electrical Speed (RPM)");
  const auto optical = optional_column(table, "Motor Optical Speed (RPM)");
  const auto torque = optional_column(table, "Torque (N·m)");
  const auto voltage = optional_column(table, "Voltage (V)");
  const auto current = optional_column(table, "Current (A)");
  if (!electrical && !optical)
    refuse(table.path, table.header_line, "neither 'Motor Electrical Speed (RPM)' nor 'Motor Optical Speed (RPM)'");

  RcbenchmarkLog log;
  log.path = table.path;
  log.thrust_unit = unit.unit;
  log.has_electrical = electrical.has_value();
  log.has_optical = optical.has_value();
  log.problems = table.problems;
  for (const TableRow& row : table.rows) {
    const auto value = parse_number(row.fields[thrust]);
    if (!value) {
      log.problems.push_back({row.line, "thrust is no number; the line is left out"});
      continue;
    }
    log.rows.push_back({row.line, field(row, time), field(row, esc), field(row, electrical), field(row, optical),
                        *value * unit.newtons, field(row, torque), field(row, voltage), field(row, current)});
  }
  return log;
}

ImportedTable select_rows(const RcbenchmarkLog& log, const RcbenchmarkSelection& selection) {
  const SpeedSource source = choose_speed(log, selection);
  ImportedTable imported;
  imported.tare_n = tare_of(log, selection, source);
  imported.unit = log.thrust_unit;
  imported.speed_source = source == SpeedSource::electrical ? "electrical" : "optical";
  imported.rows_total = log.rows.size() + log.problems.size();
  imported.problems = log.problems;
  const double sign = selection.reverse_thrust ? -1 : 1;
  for (const RcbenchmarkRow& row : log.rows) {
    if (!is_point(row, selection, source)) continue;
    results::StepMean step;
    step.propeller = std::filesystem::path(log.path).stem().string();
    step.repetition = 1;
    step.step = static_cast<int>(imported.steps.size());
    step.speed_rad_s = from_rpm(*rpm_of(row, source) * selection.speed_factor).value();
    step.speed_n = 1;
    step.thrust_n = sign * (row.thrust_n - imported.tare_n);
    step.thrust_samples = 1;
    step.torque_nm = row.torque_nm.value_or(kNotMeasured);
    step.zero_n = sign * imported.tare_n;
    step.supply_voltage_v = row.voltage_v.value_or(kNotMeasured);
    step.speed_sd_rad_s = step.thrust_sd_n = step.torque_sd_nm = kNotMeasured;
    step.motor_current_a = step.coil_temperature_degc = kNotMeasured;
    step.supply_current_a = row.current_a.value_or(kNotMeasured);
    step.window_begin_s = step.window_end_s = row.time_s.value_or(0);
    imported.steps.push_back(std::move(step));
  }
  if (imported.steps.empty()) {
    refuse(log.path, 1,
           fmt::format("no row with {} speed above {} RPM{}", imported.speed_source, selection.speed_above_rpm,
                       selection.speed ? "; try the other speed" : ""));
  }
  refuse_reversed_thrust(imported.steps, log.path);
  return imported;
}

std::vector<Point> points_of(const std::vector<results::StepMean>& steps) {
  std::vector<Point> points;
  for (const results::StepMean& step : steps) points.push_back({step.speed_rad_s, step.thrust_n, 1});
  return points;
}

void refuse_reversed_thrust(const std::vector<results::StepMean>& steps, const std::string& path) {
  double sum = 0;
  for (const results::StepMean& step : steps) sum += step.thrust_n * step.speed_rad_s * step.speed_rad_s;
  if (sum < 0) refuse(path, 1, "thrust falls with speed: its sign is reversed; import with --reverse-thrust");
}

}  // namespace kphi::fit
