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

std::optional<ThrustCurve> ThrustCurve::from_table(const OcclusionTable& k, Radians largest_fitted,
                                                   OverlapMeasure overlap) noexcept {
  if (k.empty()) return std::nullopt;
  Real least = k.begin()->value;
  for (const Knot& knot : k) {
    if (!(knot.value > 0 && knot.value <= least)) return std::nullopt;
    least = knot.value;
  }
  const ThrustCoefficient first(k.begin()->value);
  auto curve = from_line(first, first, 0, largest_fitted, overlap);
  if (curve) curve->table_ = k;
  return curve;
}

bool ThrustCurve::set_speed_trend(const SpeedTrend& trend) noexcept {
  if (!positive(trend.reference.value())) return false;
  if (!(std::fabs(trend.per_rad_s * trend.reference.value()) <= SpeedTrend::kMost)) return false;
  speed_trend_ = trend;
  return true;
}

bool ThrustCurve::set_torque_share(const OcclusionTable& share) noexcept {
  for (const Knot& knot : share) {
    if (!(knot.value > 0 && knot.value < kMostTorque)) return false;
  }
  torque_share_ = share;
  return true;
}

std::optional<ThrustCurve> ThrustCurve::perturbed(ThrustCoefficient raised, Real steepness) const noexcept {
  ThrustCurve result = *this;
  result.line_.intercept = line_.intercept + raised;
  result.line_.slope_per_rad = line_.slope_per_rad * steepness;
  if (!table_.empty()) result.table_ = table_.moved(table_.begin()->value + raised.value(), steepness);
  return positive(result.at(Radians(0)).value()) && std::isfinite(steepness) ? std::optional<ThrustCurve>(result)
                                                                             : std::nullopt;
}

Real SpeedTrend::speed_for(Real plain) const noexcept {
  // Newton on ratio² factor(ratio plain) = 1, whose left side rises for whatever set_speed_trend() lets pass.
  constexpr int kSteps = 3;
  Real ratio = 1 / std::sqrt(factor_at(plain));
  for (int i = 0; i < kSteps; ++i) {
    const Real factor = factor_at(ratio * plain);
    const bool held = factor <= 1 - kMost || factor >= 1 + kMost;
    const Real change = held ? Real(0) : per_rad_s * ratio * plain;
    ratio -= (ratio * ratio * factor - 1) / (ratio * (2 * factor + change));
  }
  return ratio * plain;
}

bool ThrustCurve::has_uncertainty() const noexcept {
  if (table_.empty()) return line_.uncertainty.has_value();
  for (const Knot& knot : table_) {
    if (!std::isfinite(knot.standard_error)) return false;
  }
  return true;
}

Real ThrustCurve::standard_error_at(Radians occlusion_angle) const noexcept {
  if (!table_.empty()) return table_.standard_error_at(occlusion_angle);
  const auto& u = line_.uncertainty;
  return u ? std::sqrt(std::max(variance_at(*u, occlusion_angle.value()), Real(0))) : kUnknown;
}

Real ThrustCurve::relative_uncertainty(Radians occlusion_angle, Radians angle_uncertainty,
                                       ScalingLaw law) const noexcept {
  const Real phi = occlusion_angle.value(), reference = thrust_coefficient_.value(), k = at(occlusion_angle).value();
  const Real factor = scaling_factor(occlusion_angle, law);
  if (!has_uncertainty() || std::isnan(phi) || !(factor > kScalingFloor)) return kUnknown;
  const bool line = table_.empty();
  const Real of_thrust_coefficient = line ? line_.uncertainty->thrust_coefficient : table_.begin()->standard_error;
  if (law == ScalingLaw::clamped && !(factor < 1)) return of_thrust_coefficient / reference;
  const Real of_curve = standard_error_at(occlusion_angle);
  const Real from_angle = (line ? line_.slope_per_rad : table_.slope_at(occlusion_angle)) * angle_uncertainty.value();
  Real variance = of_curve * of_curve + from_angle * from_angle;
  // The published law reflects the curve at K_T: K_T k_i = 2 K_T − k there.
  if (k > reference) variance += 4 * of_thrust_coefficient * of_thrust_coefficient;
  const Real relative = std::sqrt(std::max(variance, Real(0))) / (reference * factor);
  return std::isnan(relative) ? kUnknown : relative;
}

}  // namespace kphi::compensation
