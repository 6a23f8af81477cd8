#include "fit/model/identification.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "base/error.hpp"
#include "base/text.hpp"
#include "compensation/units.hpp"
#include "fit/model/averaged_runs.hpp"
#include "results/reduction/run_zero.hpp"

namespace kphi::fit {
namespace {

using results::StepMean;

using StepsByAngle = std::map<double, std::vector<StepMean>>;

double highest_common_level(const StepsByAngle& by_angle) {
  double highest = 0;
  for (const StepMean& step : by_angle.begin()->second) {
    const bool everywhere = std::ranges::all_of(by_angle, [&](const auto& entry) {
      return std::ranges::any_of(entry.second, [&](const StepMean& at) { return same_level(level(at), level(step)); });
    });
    if (everywhere) highest = std::max(highest, level(step));
  }
  return highest;
}

ThrustForm form_of(Estimator estimator) {
  if (estimator == Estimator::with_offset) return ThrustForm::with_offset;
  return estimator == Estimator::polynomial ? ThrustForm::three_terms : ThrustForm::through_origin;
}

/// T/ω² of the map at a speed, and its error by the covariance of the terms.
void take_map_at(double speed, const ThrustFit& fit, OcclusionCoefficient& row) {
  row.k = thrust(fit.parameters, speed) / (speed * speed);
  const std::array<double, 3> gradient{1, 1 / speed, 1 / (speed * speed)};
  double variance = 0;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j) variance += gradient[i] * gradient[j] * fit.covariance[i][j];
  row.standard_error = std::sqrt(std::max(0.0, variance));
}

OcclusionCoefficient coefficient(double phi_deg, std::vector<StepMean> steps, const IdentificationOptions& options,
                                 double at_speed) {
  const std::vector<Point> points = points_of(steps);
  std::vector<Point> at_level;
  std::set<int> levels, repetitions;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const StepMean& step = steps[i];
    if (at_speed > 0 && same_level(level(step), at_speed) && step.speed_rad_s > 0) at_level.push_back(points[i]);
    levels.insert(step.step);
    repetitions.insert(step.repetition);
  }
  OcclusionCoefficient row;
  row.phi_deg = phi_deg;
  row.fit = fit_thrust(points, {form_of(options.estimator), options.weighting, options.loss});
  row.k = row.fit->parameters.k;
  row.standard_error = row.fit->standard_error.k;
  row.steps = levels.size();
  row.repetitions = repetitions.size();
  if (const auto averaged = repetitions_averaged(steps)) row.repetitions = static_cast<std::size_t>(*averaged);
  if (!at_level.empty()) row.at_speed = k_at_speed(at_level);
  if (options.estimator == Estimator::polynomial || options.estimator == Estimator::at_speed) {
    if (!row.at_speed) throw FitError("no good step at the reference speed; name a speed of the profile");
    if (options.estimator == Estimator::polynomial) take_map_at(at_speed, *row.fit, row);
    if (options.estimator == Estimator::at_speed) {
      row.k = row.at_speed->k;
      if (!std::isnan(row.at_speed->standard_error)) row.standard_error = row.at_speed->standard_error;
    }
  }
  row.measured = std::move(steps);
  return row;
}

AveragedRuns runs_of(const OcclusionCoefficient& row, const ThrustFit& fit, const results::ZeroMovement& movement) {
  if (auto averaged = averaged_runs(row.phi_deg, row.measured, fit, row.k, movement)) return *std::move(averaged);
  AveragedRuns measured{sums_of_runs(row.phi_deg, row.measured, fit, row.k, movement), {}};
  measured.within = scatter_within_runs(row.measured, fit, row.k, measured.runs);
  return measured;
}

/// For "k at a speed" only the steps at that speed; otherwise all steps, with the weights of the fit.
AngleScatter scatter_of(const OcclusionCoefficient& row, Estimator estimator, double at_speed,
                        const results::ZeroMovement& movement) {
  if (estimator != Estimator::at_speed) {
    auto [runs, within] = runs_of(row, *row.fit, movement);
    if (estimator != Estimator::through_origin) {
      // The other terms of the map are fitted too, and their errors are part of the error of k.
      within.variance = row.standard_error * row.standard_error * static_cast<double>(runs.size());
      within.freedom = static_cast<double>(row.fit->n) - (estimator == Estimator::with_offset ? 2 : 3);
    }
    return scatter_of_angle(row.k, std::move(runs), within);
  }
  ThrustFit at_level = *row.fit;
  at_level.parameters = {row.k, 0, 0};
  for (std::size_t i = 0; i < row.measured.size(); ++i) {
    const double square = row.measured[i].speed_rad_s * row.measured[i].speed_rad_s;
    const bool there = same_level(level(row.measured[i]), at_speed) && square > 0;
    at_level.points[i].weight = there ? 1 / (square * square) : 0;
    at_level.robust_weights[i] = 1;
  }
  return scatter_of_angle(row.k, runs_of(row, at_level, movement).runs, {});
}

void require_one_propeller(std::span<const StepMean> steps) {
  if (steps.empty()) throw FitError("no steps: the table is empty");
  for (const StepMean& step : steps) {
    if (step.propeller != steps.front().propeller) {
      throw FitError(fmt::format("steps of two propellers, \"{}\" and \"{}\"; fit each by itself",
                                 steps.front().propeller, step.propeller));
    }
  }
}

/// A missing run is probably a typing error.
void require_runs(std::span<const StepMean> steps, const std::vector<LeftOutRun>& left_out) {
  for (const LeftOutRun& run : left_out) {
    const bool there = std::ranges::any_of(steps, [&](const StepMean& step) {
      return step.occlusion_deg == run.phi_deg && step.repetition == run.repetition;
    });
    if (!there)
      throw FitError(fmt::format("no run at phi = {} deg, repetition {}, to leave out", run.phi_deg, run.repetition));
  }
}

StepsByAngle by_angle(std::span<const StepMean> steps) {
  StepsByAngle result;
  for (const StepMean& step : steps) result[step.occlusion_deg].push_back(step);
  return result;
}

/// The curve through the table, if an occlusion was measured. Throws FitError if it cannot fly.
Identification with_curve(Identification result) {
  if (const auto& only = result.table.front(); result.table.size() == 1 && only.phi_deg == 0 && only.fit) {
    result.curve_fit.K_T = only.k;
    result.curve_fit.K_T_standard_error = only.standard_error;
    return result;
  }
  result.curve_fit = fit_curve(points_of(result.table), result.options.curve);
  (void)result.curve();
  return result;
}

std::string no_step_left(std::span<const StepMean> steps, const StepSelection& selection, const SpeedRange& range) {
  const double fastest = to_rpm(RadPerSec(level(*std::ranges::max_element(steps, {}, level))));
  const double least = to_rpm(RadPerSec(range.min_rad_s));
  std::string text = fmt::format("no step left to fit: {} outside the speed range, {} flagged", selection.outside_range,
                                 selection.flagged.size());
  if (fastest < least)
    text += fmt::format("; the fastest is at {:.0f} RPM, those from {:.0f} RPM on are fitted{}", fastest, least,
                        to_rpm(RadPerSec(fastest)) > least ? " (if it is rad/s, name the unit of the speed)" : "");
  return text + "; widen the range (--speed-range-rpm) or repeat the runs";
}

}  // namespace

std::optional<Estimate> air_of(std::span<const results::StepMean> steps) {
  if (steps.empty()) return std::nullopt;
  Estimate mean;
  const double n = static_cast<double>(steps.size());
  for (const results::StepMean& step : steps) {
    if (!(step.air_density_kg_m3 > 0)) return std::nullopt;
    mean.value += step.air_density_kg_m3 / n;
    mean.u += (std::isnan(step.air_density_u_kg_m3) ? 0.0 : step.air_density_u_kg_m3) / n;
  }
  return mean;
}

bool speeds_known(const Identification& identification) {
  return identification.speed_max_rad_s > identification.speed_min_rad_s &&
         std::isfinite(identification.speed_max_rad_s);
}

bool same_level(double a_rad_s, double b_rad_s) {
  constexpr double kShare = 0.005;
  return std::abs(a_rad_s - b_rad_s) <= kShare * std::max(a_rad_s, b_rad_s);
}

const char* name_of(Estimator estimator) {
  constexpr std::array<const char*, 4> names{"origin", "offset", "polynomial", "speed"};
  return names[static_cast<std::size_t>(estimator)];
}

const char* name_of(Weighting weighting) {
  constexpr std::array<const char*, 3> names{"equal", "thrust", "effective-variance"};
  return names[static_cast<std::size_t>(weighting)];
}

std::vector<OcclusionCoefficient> coefficients_of(std::span<const StepMean> steps, const IdentificationOptions& options,
                                                  double at_speed_rad_s, Repeatability& repeatability) {
  std::vector<OcclusionCoefficient> table;
  std::vector<AngleScatter> scatter;
  results::ZeroMovement movement;
  for (const StepMean& step : steps) movement.add(step);
  for (auto& [phi_deg, measured] : by_angle(steps)) {
    try {
      table.push_back(coefficient(phi_deg, measured, options, at_speed_rad_s));
    } catch (const FitError& error) {
      throw FitError(fmt::format("phi = {} deg: {}", phi_deg, error.what()));
    }
    scatter.push_back(scatter_of(table.back(), options.estimator, at_speed_rad_s, movement));
  }
  repeatability = fit::repeatability(std::move(scatter), {movement.usual_n(), 0, movement.runs()});
  const double mounting = options.mounting.value_or(kAssumedMounting);
  if (!repeatability.repeated) repeatability.between.u = mounting;
  repeatability.mounted_once = options.mounted_once && repeatability.repeated;
  if (repeatability.mounted_once) repeatability.mounting = mounting;
  repeatability.mounting_assumed = !options.mounting && (repeatability.mounted_once || !repeatability.repeated);
  for (std::size_t i = 0; i < table.size(); ++i) {
    OcclusionCoefficient& row = table[i];
    row.standard_error = repeatability.independent_u(i);
    row.air = air_of(row.measured);
  }
  return table;
}

Identification identify(std::span<const StepMean> steps, const IdentificationOptions& options) {
  require_one_propeller(steps);
  Identification result;
  result.options = options;
  result.propeller = options.propeller.empty() ? printable(steps.front().propeller) : options.propeller;
  result.diameter_in = options.diameter_in > 0 ? options.diameter_in : steps.front().diameter_in;
  result.blades = options.blades > 0 ? options.blades : steps.front().blades;
  require_runs(steps, options.left_out);
  result.selection = select_steps(steps, options.speed_range, options.left_out);
  result.air = air_of(result.selection.used);
  const StepsByAngle angles = by_angle(result.selection.used);
  if (angles.empty()) {
    throw FitError(no_step_left(steps, result.selection, options.speed_range));
  }
  result.at_speed_rad_s = options.at_speed_rad_s.value_or(highest_common_level(angles));

  result.speed_max_rad_s = std::numeric_limits<double>::infinity();
  result.fitted = {std::numeric_limits<double>::infinity(), 0};
  for (const auto& [phi_deg, used] : angles) {
    const auto [low, high] = std::ranges::minmax_element(used, {}, level);
    result.fitted.min_rad_s = std::min(result.fitted.min_rad_s, level(*low));
    result.fitted.max_rad_s = std::max(result.fitted.max_rad_s, level(*high));
    result.speed_min_rad_s = std::max(result.speed_min_rad_s, level(*low));
    result.speed_max_rad_s = std::min(result.speed_max_rad_s, level(*high));
  }
  result.table = coefficients_of(result.selection.used, options, result.at_speed_rad_s, result.repeatability);
  if (options.at_speed_rad_s && !result.table.front().at_speed) {
    throw FitError(fmt::format("no good step at {:.0f} RPM; name a speed of the profile",
                               to_rpm(RadPerSec(*options.at_speed_rad_s))));
  }
  return with_curve(std::move(result));
}

std::vector<CurvePoint> points_of(std::span<const OcclusionCoefficient> table) {
  std::vector<CurvePoint> points;
  for (const OcclusionCoefficient& row : table) points.push_back({row.phi_deg, row.k, row.standard_error});
  return points;
}

Identification identify_table(std::span<const CurvePoint> points, const IdentificationOptions& options) {
  Identification result;
  result.options = options;
  result.propeller = options.propeller;
  result.diameter_in = options.diameter_in;
  result.blades = options.blades;
  for (const CurvePoint& point : points)
    result.table.push_back({.phi_deg = point.phi_deg, .k = point.k, .standard_error = point.standard_error});
  std::ranges::sort(result.table, {}, &OcclusionCoefficient::phi_deg);
  result.fitted = options.speed_range;
  result.speed_min_rad_s = options.speed_range.min_rad_s;
  result.speed_max_rad_s = options.speed_range.max_rad_s;
  return with_curve(std::move(result));
}

}  // namespace kphi::fit
