#include "fit/logs/row_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/error.hpp"
#include "base/statistics.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

using results::kNotMeasured;

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw ConfigurationError(fmt::format("{}:1: {}", path, what));
}

double tare_of(const StandLog& log, const RowSelection& selection, SpeedSource source) {
  if (selection.tare_rows == 0) return 0;
  std::vector<double> zeros;
  for (const StandRow& row : log.rows)
    if (zeros.size() < selection.tare_rows && motor_off(row, source)) zeros.push_back(row.thrust_n);
  if (zeros.size() < selection.tare_rows) {
    refuse(log.path,
           fmt::format("{} rows with the motor off, but --tare-rows asks for {}", zeros.size(), selection.tare_rows));
  }
  const double sd = zeros.size() > 1 ? std::sqrt(variance(zeros)) : 0;
  if (sd > kTareScatterMax * largest_thrust(log)) {
    refuse(log.path,
           fmt::format("the rows for the tare scatter by {:.3g} N, {:.1f} % of the largest thrust, and cannot "
                       "give a zero; use fewer rows (--tare-rows) or no tare",
                       sd, 100 * sd / largest_thrust(log)));
  }
  return mean(zeros);
}

bool is_point(const StandRow& row, const RowSelection& selection, SpeedSource source) {
  if (!(rpm_of(row, source).value_or(0) > selection.speed_above_rpm)) return false;
  if (selection.throttle_above_us && !(row.throttle_us.value_or(0) > *selection.throttle_above_us)) return false;
  if (!selection.optical_per_electrical) return true;
  const double electrical = row.electrical_rpm.value_or(0);
  return electrical > 0 && std::abs(row.optical_rpm.value_or(0) / electrical - *selection.optical_per_electrical) <=
                               selection.ratio_tolerance;
}

results::StepMean step_of(const StandRow& row, const RowSelection& selection, SpeedSource source, double tare_n) {
  const double sign = selection.reverse_thrust ? -1 : 1;
  results::StepMean step = step_of_row(*rpm_of(row, source) * selection.speed_factor, sign * (row.thrust_n - tare_n));
  step.occlusion_deg = row.occlusion_deg.value_or(0);
  step.repetition = static_cast<int>(row.repetition.value_or(1));
  step.torque_nm = row.torque_nm.value_or(kNotMeasured);
  step.zero_n = sign * tare_n;
  step.supply_voltage_v = row.voltage_v.value_or(kNotMeasured);
  step.supply_current_a = row.current_a.value_or(kNotMeasured);
  step.window_begin_s = step.window_end_s = row.time_s.value_or(0);
  return step;
}

}  // namespace

results::StepMean step_of_row(double speed_rpm, double thrust_n) {
  results::StepMean step;
  step.repetition = 1;
  step.speed_rad_s = from_rpm(speed_rpm).value();
  step.thrust_n = thrust_n;
  step.speed_n = step.thrust_samples = 1;
  for (const auto member :
       {&results::StepMean::speed_sd_rad_s, &results::StepMean::thrust_sd_n, &results::StepMean::torque_nm,
        &results::StepMean::torque_sd_nm, &results::StepMean::supply_voltage_v, &results::StepMean::supply_current_a,
        &results::StepMean::motor_current_a, &results::StepMean::coil_temperature_degc})
    step.*member = kNotMeasured;
  return step;
}

SpeedSource choose_speed(const StandLog& log, const RowSelection& selection) {
  const bool electrical_turns = std::any_of(log.rows.begin(), log.rows.end(),
                                            [](const StandRow& row) { return row.electrical_rpm.value_or(0) > 0; });
  const SpeedSource source =
      selection.speed.value_or(electrical_turns || !log.has_optical ? SpeedSource::electrical : SpeedSource::optical);
  if (source == SpeedSource::electrical && !log.has_electrical)
    refuse(log.path, "no electrical speed in the file; use the optical one (--speed optical)");
  if (source == SpeedSource::optical && !log.has_optical)
    refuse(log.path, "no optical speed in the file; use the electrical one (--speed electrical)");
  return source;
}

ImportedTable select_rows(const StandLog& log, const RowSelection& selection) {
  const SpeedSource source = choose_speed(log, selection);
  ImportedTable imported;
  imported.tare_n = tare_of(log, selection, source);
  imported.unit = log.thrust_unit;
  imported.speed_source = source == SpeedSource::electrical ? "electrical" : "optical";
  imported.rows_total = log.rows.size() + log.problems.size();
  imported.problems = log.problems;
  imported.unread = log.unread;
  for (const StandRow& row : log.rows) {
    if (!is_point(row, selection, source)) continue;
    results::StepMean step = step_of(row, selection, source, imported.tare_n);
    step.propeller = std::filesystem::path(log.path).stem().string();
    step.step = static_cast<int>(imported.steps.size());
    imported.steps.push_back(std::move(step));
    imported.lines.push_back(row.line);
  }
  if (imported.steps.empty()) {
    refuse(log.path, fmt::format("no row with {} speed above {} RPM{}", imported.speed_source,
                                 selection.speed_above_rpm, selection.speed ? "; try the other speed" : ""));
  }
  refuse_reversed_thrust(imported.steps, log.path);
  return imported;
}

void refuse_reversed_thrust(const std::vector<results::StepMean>& steps, const std::string& path) {
  double sum = 0;
  for (const results::StepMean& step : steps) sum += step.thrust_n * step.speed_rad_s * step.speed_rad_s;
  if (sum < 0) refuse(path, "thrust falls with speed: its sign is reversed; import with --reverse-thrust");
}

}  // namespace kphi::fit
