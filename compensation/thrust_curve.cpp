#include "compensation/thrust_curve.hpp"

#include <limits>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

constexpr Real kUnknown = std::numeric_limits<Real>::infinity();

bool not_negative(Real value) noexcept { return is_finite(value) && value >= 0; }

/// Of k: positive, and not rising. Of a torque share: in (0, kMostTorque).
bool fit(const KnotList& knots, bool falling) noexcept {
  Real most = falling ? std::numeric_limits<Real>::max() : kMostTorque * (1 - std::numeric_limits<Real>::epsilon());
  for (std::size_t i = 0; i < knots.count; ++i) {
    const Real value = knots[i].value;
    if (!(value > 0 && value <= most)) return false;
    if (falling) most = value;
  }
  return true;
}

bool sound(const SpeedTrend& trend) noexcept {
  return is_positive(trend.reference.value()) && is_finite(trend.per_rad_s) &&
         std::fabs(trend.per_rad_s * trend.reference.value()) <= SpeedTrend::kMost;
}

Real variance_at(const LineUncertainty& u, Real phi) noexcept {
  return u.intercept_variance + phi * (2 * u.covariance + phi * u.slope_variance);
}

}  // namespace

bool sound(const LineUncertainty& u) noexcept {
  return not_negative(u.thrust_coefficient) && not_negative(u.intercept_variance) && is_finite(u.covariance) &&
         not_negative(u.slope_variance);
}

Real scaling_factor_of(Real k, Real thrust_coefficient, Radians occlusion_angle, ScalingLaw law) noexcept {
  if (law == ScalingLaw::published) return 1 - std::fabs(thrust_coefficient - k) / thrust_coefficient;
  if (is_nan(occlusion_angle.value()) || occlusion_angle.value() <= 0) return 1;
  return std::min(Real(1), std::max(kScalingFloor, k / thrust_coefficient));
}

bool sound(const CurveParts& parts) noexcept {
  if (!is_positive(parts.largest_fitted.value()) || parts.largest_fitted.value() > 2 * kPi) return false;
  if (parts.overlap > OverlapMeasure::load_share || !is_positive(parts.thrust_coefficient.value())) return false;
  if (parts.k.count == 0) {
    if (!is_positive(parts.intercept.value()) || !is_finite(parts.slope_per_rad)) return false;
  } else if (!sound(parts.k) || !fit(parts.k, true)) {
    return false;
  }
  if (parts.torque.count != 0 && (!sound(parts.torque) || !fit(parts.torque, false))) return false;
  const bool trend = is_nan(parts.speed_trend.per_rad_s) || std::fabs(parts.speed_trend.per_rad_s) > 0;
  return !trend || sound(parts.speed_trend);
}

CurveParts ThrustCurve::parts() const noexcept {
  return {thrust_coefficient_, line_.intercept,      line_.slope_per_rad, largest_fitted_, overlap_,
          table_.list(),       torque_share_.list(), speed_trend_};
}

std::optional<ThrustCurve> ThrustCurve::from_line(ThrustCoefficient thrust_coefficient, ThrustCoefficient intercept,
                                                  Real slope_per_rad, Radians largest_fitted, OverlapMeasure overlap,
                                                  const std::optional<LineUncertainty>& uncertainty) noexcept {
  const ThrustCurve curve(thrust_coefficient, {intercept, slope_per_rad, uncertainty}, largest_fitted, overlap);
  if ((uncertainty && !sound(*uncertainty)) || !sound(curve.parts())) return std::nullopt;
  return curve;
}

std::optional<ThrustCurve> ThrustCurve::from_table(const OcclusionTable& k, Radians largest_fitted,
                                                   OverlapMeasure overlap) noexcept {
  if (k.empty()) return std::nullopt;
  const ThrustCoefficient first(k.begin()->value);
  ThrustCurve curve(first, {first, 0, std::nullopt}, largest_fitted, overlap);
  curve.table_ = k;
  return sound(curve.parts()) ? std::optional<ThrustCurve>(curve) : std::nullopt;
}

bool ThrustCurve::set_speed_trend(const SpeedTrend& trend) noexcept {
  if (!sound(trend)) return false;
  speed_trend_ = trend;
  return true;
}

bool ThrustCurve::set_torque_share(const OcclusionTable& share) noexcept {
  if (!fit(share.list(), false)) return false;
  torque_share_ = share;
  return true;
}

std::optional<ThrustCurve> ThrustCurve::perturbed(ThrustCoefficient raised, Real steepness) const noexcept {
  ThrustCurve result = *this;
  result.line_.intercept = line_.intercept + raised;
  result.line_.slope_per_rad = line_.slope_per_rad * steepness;
  if (!table_.empty()) result.table_ = table_.moved(table_.begin()->value + raised.value(), steepness);
  return is_positive(result.at(Radians(0)).value()) && is_finite(steepness) ? std::optional<ThrustCurve>(result)
                                                                            : std::nullopt;
}

Real SpeedTrend::factor_at(Real speed) const noexcept {
  return std::min(1 + kMost, std::max(1 - kMost, 1 + per_rad_s * (speed - reference.value())));
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
    if (!is_finite(knot.standard_error)) return false;
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
  if (!has_uncertainty() || is_nan(phi) || !(factor > kScalingFloor)) return kUnknown;
  const bool line = table_.empty();
  const Real of_thrust_coefficient = line ? line_.uncertainty->thrust_coefficient : table_.begin()->standard_error;
  if (law == ScalingLaw::clamped && !(factor < 1)) return of_thrust_coefficient / reference;
  const Real of_curve = standard_error_at(occlusion_angle);
  const Real from_angle = (line ? line_.slope_per_rad : table_.slope_at(occlusion_angle)) * angle_uncertainty.value();
  Real variance = of_curve * of_curve + from_angle * from_angle;
  // The published law reflects the curve at K_T: K_T k_i = 2 K_T − k there.
  if (k > reference) variance += 4 * of_thrust_coefficient * of_thrust_coefficient;
  const Real relative = std::sqrt(std::max(variance, Real(0))) / (reference * factor);
  return is_nan(relative) ? kUnknown : relative;
}

}  // namespace kphi::compensation
