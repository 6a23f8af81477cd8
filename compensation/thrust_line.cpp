#include "compensation/thrust_line.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::compensation {
namespace {

bool positive(double value) noexcept { return std::isfinite(value) && value > 0.0; }

}  // namespace

std::optional<ThrustLine> ThrustLine::from(ThrustCoefficient thrust_coefficient, ThrustCoefficient intercept,
                                           double slope_per_rad, Radians largest_fitted) noexcept {
  if (!positive(thrust_coefficient.value()) || !positive(intercept.value())) return std::nullopt;
  if (!std::isfinite(slope_per_rad)) return std::nullopt;
  if (!positive(largest_fitted.value()) || largest_fitted.value() > 2 * kPi) return std::nullopt;
  return ThrustLine(thrust_coefficient, intercept, slope_per_rad, largest_fitted);
}

double ThrustLine::scaling_factor(Radians occlusion_angle, ScalingLaw law) const noexcept {
  const double reference = thrust_coefficient_.value();
  const double k = at(occlusion_angle).value();
  if (law == ScalingLaw::published) return 1.0 - std::fabs(reference - k) / reference;
  if (!(occlusion_angle.value() > 0.0)) return 1.0;
  return std::min(1.0, std::max(kScalingFloor, k / reference));
}

}  // namespace kphi::compensation
