#include "fit/logs/row_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "base/error.hpp"
#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "fit/logs/thrust_slope.hpp"

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

/// Most rows with a thrust have no speed: what is left of the log says nothing of its propeller.
void refuse_blind_speed(const StandLog& log, SpeedSource source) {
  const double there = std::max(0.05 * largest_thrust(log), from_gram_force(5).value());
  std::size_t blind = 0, pulling = 0;
  for (const StandRow& row : log.rows) {
    if (std::abs(row.thrust_n) < there || (row.throttle_us && *row.throttle_us <= kIdleUs)) continue;
    ++pulling;
    if (!(rpm_of(row, source).value_or(0) > 0)) ++blind;
  }
  if (2 * blind <= pulling) return;
  const bool other = source == SpeedSource::electrical ? log.has_optical : log.has_electrical;
  refuse(log.path,
         fmt::format("the {} speed reads 0 in {} of {} rows with thrust: its sensor does not see the propeller; {}",
                     source == SpeedSource::electrical ? "electrical" : "optical", blind, pulling,
                     !other                              ? "measure again with one that does"
                     : source == SpeedSource::electrical ? "take the other with --speed optical"
                                                         : "take the other with --speed electrical"));
}

}  // namespace

double ImportedTable::speed_rad_s(std::size_t row) const {
  return from_rpm(*(rows[row].*speed) * speed_factor).value();
}

double ImportedTable::thrust_n(std::size_t row) const { return rows[row].thrust_n - tare_n; }

results::StepMean ImportedTable::step(std::size_t index) const {
  const StandRow& row = rows[index];
  results::StepMean step;
  step.propeller = propeller;
  step.blades = blades;
  step.diameter_in = diameter_in;
  step.air_density_kg_m3 = air_density_kg_m3;
  step.occlusion_deg = row.occlusion_deg.value_or(0);
  step.repetition = static_cast<int>(row.repetition.value_or(1));
  step.step = static_cast<int>(index);
  step.speed_rad_s = speed_rad_s(index);
  step.thrust_n = thrust_n(index);
  step.speed_n = step.thrust_samples = 1;
  step.speed_sd_rad_s = step.thrust_sd_n = step.torque_sd_nm = kNotMeasured;
  step.torque_nm = row.torque_nm.value_or(kNotMeasured);
  step.zero_n = tare_n;
  step.zero_u_n = zero_u_n;
  step.supply_voltage_v = row.voltage_v.value_or(kNotMeasured);
  step.supply_current_a = row.current_a.value_or(kNotMeasured);
  step.motor_current_a = step.coil_temperature_degc = kNotMeasured;
  step.window_begin_s = step.window_end_s = row.time_s.value_or(0);
  step.quality_flags = quality_flags[index];
  return step;
}

std::vector<Point> points_of(const ImportedTable& imported) {
  std::vector<Point> points;
  points.reserve(imported.size());
  for (std::size_t i = 0; i < imported.size(); ++i) points.push_back({imported.speed_rad_s(i), imported.thrust_n(i)});
  return points;
}

std::vector<Point> some_points(const ImportedTable& imported) {
  constexpr std::size_t kEnough = 20'000;
  const std::size_t count = std::min(imported.size(), kEnough);
  std::vector<Point> points;
  points.reserve(count);
  for (std::size_t n = 0; n < count; ++n) {
    const std::size_t i = n * imported.size() / count;
    if (!imported.is_left_out(i)) points.push_back({imported.speed_rad_s(i), imported.thrust_n(i)});
  }
  return points;
}

SpeedSource choose_speed(const StandLog& log, const RowSelection& selection) {
  const bool electrical_turns = log.has_electrical && std::ranges::any_of(log.rows, [](const StandRow& row) {
                                  return row.electrical_rpm.value_or(0) > 0;
                                });
  const SpeedSource source =
      selection.speed.value_or(electrical_turns || !log.has_optical ? SpeedSource::electrical : SpeedSource::optical);
  if (source == SpeedSource::electrical && !log.has_electrical)
    refuse(log.path, "no electrical speed in the file; use the optical one (--speed optical)");
  if (source == SpeedSource::optical && !log.has_optical)
    refuse(log.path, "no optical speed in the file; use the electrical one (--speed electrical)");
  return source;
}

void turn_thrust(StandLog& log) {
  for (StandRow& row : log.rows) row.thrust_n = -row.thrust_n;
  log.turned = !log.turned;
}

ImportedTable select_rows(StandLog log, const RowSelection& selection) {
  if (selection.reverse_thrust) turn_thrust(log);
  const SpeedSource source = choose_speed(log, selection);
  ImportedTable imported;
  imported.speed = source == SpeedSource::electrical ? &StandRow::electrical_rpm : &StandRow::optical_rpm;
  imported.speed_factor = selection.speed_factor;
  imported.tare_n = tare_of(log, selection, source);
  imported.reverse_thrust = log.turned;
  imported.propeller = std::filesystem::path(log.path).stem().string();
  imported.unit = log.thrust_unit;
  imported.speed_source = source == SpeedSource::electrical ? "electrical" : "optical";
  imported.rows_total = log.rows.size() + log.problems.size();
  imported.problems = std::move(log.problems);
  imported.unread = std::move(log.unread);
  const auto left_out = [&](const StandRow& row) {
    return !(rpm_of(row, source).value_or(0) > selection.speed_above_rpm) ||
           (selection.throttle_above_us && !(row.throttle_us.value_or(0) > *selection.throttle_above_us));
  };
  if (std::ranges::all_of(log.rows, left_out)) {
    refuse(log.path, fmt::format("no row with {} speed above {} RPM{}", imported.speed_source,
                                 selection.speed_above_rpm, selection.speed ? "; try the other speed" : ""));
  }
  refuse_blind_speed(log, source);
  imported.rows = std::move(log.rows);
  std::erase_if(imported.rows, left_out);
  imported.quality_flags.resize(imported.size());
  refuse_reversed_thrust(imported, log.path);
  return imported;
}

void refuse_reversed_thrust(const ImportedTable& imported, const std::string& path) {
  const ThrustSign sign = sign_of(some_points(imported));
  const bool turned = imported.reverse_thrust;
  if (sign == ThrustSign::falls)
    refuse(path, turned ? "thrust falls with speed once it is turned: leave --reverse-thrust out"
                        : "thrust falls with speed: its sign is reversed; import with --reverse-thrust");
  if (sign == ThrustSign::cannot_tell)
    throw FitError(path +
                   ": thrust does not follow speed², so neither its sign nor its zero is known; log it again with the "
                   "motor off at the beginning, and with several speeds");
}

}  // namespace kphi::fit
