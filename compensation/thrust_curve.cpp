#include "compensation/thrust_curve.hpp"

#include <limits>

namespace kphi::compensation {
namespace {

constexpr Real kUnknown = std::numeric_limits<Real>::infinity();

bool positive(Real value) noexcept { return std::isfinite(value) && value > 0; }

bool not_negative(Real value) noexcept { return std::isfinite(value) && value >= 0; }

bool sound(const LineUncertainty& u) noexcept {
  return not_negative(u.thrust_coefficient) && not_negative(u.intercept_variance) && std::isfinite(u.covariance) &&
         not_negative(u.slope_variance);
}

Real variance_at(const LineUncertainty& u, Real phi) noexcept {
  return u.intercept_variance + phi * (2 * u.covariance + phi * u.slope_variance);
}

}  // namespace

std::optional<ThrustCurve> ThrustCurve::from_line(ThrustCoefficient thrust_coefficient, ThrustCoefficient intercept,
                                                  Real slope_per_rad, Radians largest_fitted, OverlapMeasure overlap,
                                                  const std::optional<LineUncertainty>& uncertainty) noexcept {
  if (!positive(thrust_coefficient.value()) || !positive(intercept.value())) return std::nullopt;
  if (!std::isfinite(slope_per_rad)) return std::nullopt;
  if (!positive(largest_fitted.value()) || largest_fitted.value() > 2 * kPi) return std::nullopt;
  if (overlap > OverlapMeasure::load_share || (uncertainty && !sound(*uncertainty))) return std::nullopt;
  return ThrustCurve(thrust_coefficient, {intercept, slope_per_rad, uncertainty}, largest_fitted, overlap);
}

Real ThrustCurve::standard_error_at(Radians occlusion_angle) const noexcept {
  const auto& u = line_.uncertainty;
  return u ? std::sqrt(std::max(variance_at(*u, occlusion_angle.value()), Real(0))) : kUnknown;
}

Real ThrustCurve::relative_uncertainty(Radians occlusion_angle, Radians angle_uncertainty,
                                       ScalingLaw law) const noexcept {
  const Real phi = occlusion_angle.value(), reference = thrust_coefficient_.value(), k = at(occlusion_angle).value();
  const Real factor = scaling_factor(occlusion_angle, law);
  if (!line_.uncertainty || std::isnan(phi) || !(factor > kScalingFloor)) return kUnknown;
  const LineUncertainty& u = *line_.uncertainty;
  if (law == ScalingLaw::clamped && !(factor < 1)) return u.thrust_coefficient / reference;
  const Real from_angle = line_.slope_per_rad * angle_uncertainty.value();
  Real variance = variance_at(u, phi) + from_angle * from_angle;
  // The published law reflects the curve at K_T: K_T k_i = 2 K_T − k there.
  if (k > reference) variance += 4 * u.thrust_coefficient * u.thrust_coefficient;
  const Real relative = std::sqrt(std::max(variance, Real(0))) / (reference * factor);
  return std::isnan(relative) ? kUnknown : relative;
}

}  // namespace kphi::compensation
