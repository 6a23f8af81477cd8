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

double reference_of(const Identification& identification) {
  switch (identification.options.estimator) {
    case Estimator::through_origin:
      return identification.options.weighting == Weighting::equal ? speed_of_origin(identification) : 0;
    case Estimator::polynomial:
    case Estimator::at_speed:
      return identification.at_speed_rad_s;
    case Estimator::with_offset:
      break;
  }
  return 0;
}

}  // namespace

std::optional<SpeedTrend> speed_trend(const Identification& identification, std::span<const SpeedDependence> speed) {
  SpeedTrend trend{.per_rad_s = {}, .reference_rad_s = reference_of(identification)};
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
    trend.per_rad_s.value += share * one.value;
    freedom += std::isfinite(one.freedom) ? one.freedom : 0;
    ++count;
  }
  if (count == 0 || !(trend.reference_rad_s > 0)) return std::nullopt;
  trend.per_rad_s.value /= weight;
  for (const Estimate& one : each) squares += std::pow((one.value - trend.per_rad_s.value) / one.u, 2);
  const double beyond = count > 1 ? std::max(1.0, squares / (count - 1)) : 1;  // Birge's ratio, squared
  trend.per_rad_s.u = std::sqrt(beyond / weight);
  trend.per_rad_s.freedom = std::max(1.0, freedom);
  // The library refuses a larger trend: no propeller has one.
  if (std::abs(trend.per_rad_s.value * trend.reference_rad_s) > compensation::SpeedTrend::kMost) return std::nullopt;
  return student_test(trend.per_rad_s, 0).rejected() ? std::optional(trend) : std::nullopt;
}

}  // namespace kphi::fit
