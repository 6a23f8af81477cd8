#include "fit/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "compensation/units.hpp"
#include "fit/fit_error.hpp"

namespace kphi::fit {
namespace {

using results::StepMean;

using StepsByAngle = std::map<double, std::vector<StepMean>>;

bool measured_at(const std::vector<StepMean>& steps, double speed) {
  return std::any_of(steps.begin(), steps.end(), [&](const StepMean& step) { return same_level(level(step), speed); });
}

double highest_common_level(const StepsByAngle& by_angle) {
  double highest = 0;
  for (const StepMean& step : by_angle.begin()->second) {
    const bool everywhere = std::all_of(by_angle.begin(), by_angle.end(),
                                        [&](const auto& entry) { return measured_at(entry.second, level(step)); });
    if (everywhere) highest = std::max(highest, level(step));
  }
  return highest;
}

OcclusionCoefficient coefficient(double phi_deg, const std::vector<StepMean>& steps, double at_speed) {
  std::vector<Point> points, at_level;
  std::set<int> levels, repetitions;
  for (const StepMean& step : steps) {
    points.push_back({step.speed_rad_s, step.thrust_n, 1});
    if (at_speed > 0 && same_level(level(step), at_speed) && step.speed_rad_s > 0) at_level.push_back(points.back());
    levels.insert(step.step);
    repetitions.insert(step.repetition);
  }
  OcclusionCoefficient row;
  row.phi_deg = phi_deg;
  try {
    row.fit = fit_thrust(points);
  } catch (const FitError& error) {
    throw FitError(fmt::format("phi = {} deg: {}", phi_deg, error.what()));
  }
  row.k = row.fit->parameters.k;
  row.standard_error = row.fit->standard_error.k;
  row.steps = levels.size();
  row.repetitions = repetitions.size();
  if (const auto air = air_of(steps)) row.standard = at_standard(row.k, row.standard_error, *air);
  if (!at_level.empty()) row.at_speed = k_at_speed(at_level);
  return row;
}

void require_one_propeller(std::span<const StepMean> steps) {
  if (steps.empty()) throw FitError("no steps: the table is empty");
  for (const StepMean& step : steps) {
    if (step.propeller != steps.front().propeller) {
      throw FitError(fmt::format("steps of two propellers, '{}' and '{}'; fit each by itself", steps.front().propeller,
                                 step.propeller));
    }
  }
}

StepsByAngle by_angle(const StepSelection& selection) {
  StepsByAngle result;
  for (const StepMean& step : selection.used) result[step.occlusion_deg].push_back(step);
  if (result.empty()) {
    throw FitError(
        fmt::format("no step is left to fit: {} lie outside the speed range, {} are doubtful; widen the "
                    "range or repeat the runs",
                    selection.outside_range, selection.doubtful.size()));
  }
  return result;
}

std::vector<LinePoint> line_points(const std::vector<OcclusionCoefficient>& table) {
  std::vector<LinePoint> points;
  for (const OcclusionCoefficient& row : table) points.push_back({row.phi_deg, row.k, row.standard_error});
  return points;
}

}  // namespace

bool same_level(double a_rad_s, double b_rad_s) {
  constexpr double kShare = 0.005;
  return std::abs(a_rad_s - b_rad_s) <= kShare * std::max(a_rad_s, b_rad_s);
}

Identification identify(std::span<const StepMean> steps, const IdentificationOptions& options) {
  require_one_propeller(steps);
  Identification result;
  result.propeller = steps.front().propeller;
  result.diameter_in = steps.front().diameter_in;
  result.blades = steps.front().blades;
  result.selection = select_steps(steps, options.speed_range);
  result.air = air_of(result.selection.used);
  const StepsByAngle angles = by_angle(result.selection);
  result.at_speed_rad_s = options.at_speed_rad_s.value_or(highest_common_level(angles));

  result.speed_max_rad_s = std::numeric_limits<double>::infinity();
  for (const auto& [phi_deg, used] : angles) {
    const auto [low, high] = std::minmax_element(
        used.begin(), used.end(), [](const StepMean& a, const StepMean& b) { return level(a) < level(b); });
    const bool first = result.table.empty();
    result.fitted.min_rad_s = first ? level(*low) : std::min(result.fitted.min_rad_s, level(*low));
    result.fitted.max_rad_s = std::max(result.fitted.max_rad_s, level(*high));
    result.speed_min_rad_s = std::max(result.speed_min_rad_s, level(*low));
    result.speed_max_rad_s = std::min(result.speed_max_rad_s, level(*high));
    result.table.push_back(coefficient(phi_deg, used, result.at_speed_rad_s));
  }
  if (options.at_speed_rad_s && !result.table.front().at_speed) {
    throw FitError(fmt::format("no good step at {:.0f} RPM; name a speed of the profile",
                               to_rpm(RadPerSec(*options.at_speed_rad_s))));
  }
  result.line = fit_line(line_points(result.table), options.line);
  return result;
}

Identification identify_table(std::span<const LinePoint> points, const LineFitOptions& options,
                              const SpeedRange& speed) {
  Identification result;
  result.line = fit_line(points, options);
  for (const LinePoint& point : points) {
    OcclusionCoefficient row;
    row.phi_deg = point.phi_deg;
    row.k = point.k;
    row.standard_error = point.standard_error;
    result.table.push_back(row);
  }
  std::sort(result.table.begin(), result.table.end(),
            [](const auto& a, const auto& b) { return a.phi_deg < b.phi_deg; });
  result.fitted = speed;
  result.speed_min_rad_s = speed.min_rad_s;
  result.speed_max_rad_s = speed.max_rad_s;
  return result;
}

}  // namespace kphi::fit
