#include "fit/uncertainty/speed_trend.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/thrust_curve.hpp"

namespace kphi::fit {
namespace {

/// A line through the origin, T = k ω² by least squares, has the k of the speed Σω⁵/Σω⁴.
double speed_of_origin(const Identification& identification) {
  double fifth = 0, fourth = 0;
  for (const OcclusionCoefficient& row : identification.table) {
    for (const results::StepMean& step : row.measured) {
      fourth += std::pow(step.speed_rad_s, 4);
      fifth += std::pow(step.speed_rad_s, 5);
    }
  }
  return fourth > 0 ? fifth / fourth : 0;
}

}  // namespace

double reference_speed(const Identification& identification) {
  const double fastest = identification.fitted.max_rad_s;
  switch (identification.options.estimator) {
    case Estimator::through_origin:
      return identification.options.weighting == Weighting::equal ? speed_of_origin(identification) : fastest;
    case Estimator::polynomial:
    case Estimator::at_speed:
      return identification.at_speed_rad_s;
    case Estimator::with_offset:
      break;
  }
  return fastest;
}

std::optional<Estimate> common_trend(std::span<const SpeedDependence> speed) {
  Estimate trend;
  double weight = 0, squares = 0, freedom = 0, count = 0;
  std::vector<Estimate> each;
  for (const SpeedDependence& one : speed) {
    if (one.levels.size() < 2 || !(one.change.u > 0)) continue;
    const double range = one.levels.back().speed_rad_s - one.levels.front().speed_rad_s;
    each.push_back({one.change.value / range, one.change.u / range, one.change.freedom});
  }
  for (const Estimate& one : each) {
    const double share = 1 / (one.u * one.u);
    weight += share;
    trend.value += share * one.value;
    freedom += std::isfinite(one.freedom) ? one.freedom : 0;
    ++count;
  }
  if (count == 0) return std::nullopt;
  trend.value /= weight;
  for (const Estimate& one : each) squares += std::pow((one.value - trend.value) / one.u, 2);
  const double beyond = count > 1 ? std::max(1.0, squares / (count - 1)) : 1;  // Birge's ratio, squared
  trend.u = std::sqrt(beyond / weight);
  trend.freedom = std::max(1.0, freedom);
  return trend;
}

std::optional<SpeedTrend> speed_trend(const Identification& identification, std::span<const SpeedDependence> speed) {
  const IdentificationOptions& options = identification.options;
  if (options.estimator == Estimator::with_offset ||
      (options.estimator == Estimator::through_origin && options.weighting != Weighting::equal))
    return std::nullopt;
  const auto found = common_trend(speed);
  const double reference = reference_speed(identification);
  if (!found || !(reference > 0)) return std::nullopt;
  // The library refuses a larger trend: no propeller has one.
  if (std::abs(found->value * reference) > compensation::SpeedTrend::kMost) return std::nullopt;
  return student_test(*found, 0).rejected() ? std::optional(SpeedTrend{*found, reference}) : std::nullopt;
}

}  // namespace kphi::fit
