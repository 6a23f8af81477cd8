// What the bench knows of one propeller: k(φ) (paper, Fig. 5 and equation 4), how it changes with the speed, and what φ
// does to the drag torque. The one type that all code after the fit asks. Whether k(φ) is a line or a table is its own
// affair: only what writes or prints the parameters calls visit(), with a function for each form.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "compensation/convex_polygon.hpp"
#include "compensation/occlusion_table.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// How k(φ) becomes the scaling factor k_i of ω = sqrt(T / (K_T k_i)).
enum class ScalingLaw : std::uint8_t {
  clamped,  ///< k(φ)/K_T held in [kScalingFloor, 1], exactly 1 at φ = 0: never slows a propeller down, never diverges
  published,  ///< 1 − |K_T − k(φ)|/K_T, equation 4 to the letter: below 1 also where the curve lies above K_T
};

/// The smallest k_i of ScalingLaw::clamped: the speed is raised by 1/sqrt(0.1) = 3.16 at most.
inline constexpr Real kScalingFloor = Real(0.1);

/// The largest torque at φ as a share of that without occlusion; its inverse the smallest.
inline constexpr Real kMostTorque = 10;

/// How well K_T and the line are known, one standard deviation, SI.
struct LineUncertainty {
  Real thrust_coefficient = 0;  ///< of K_T [N/(rad/s)²]
  Real intercept_variance = 0;  ///< of the line, [N/(rad/s)²]²
  Real covariance = 0;          ///< of intercept and slope, per rad
  Real slope_variance = 0;      ///< per rad²
};

/// Whether variances are finite and not negative.
[[nodiscard]] bool sound(const LineUncertainty& uncertainty) noexcept;

/// k(φ) = intercept + slope φ.
struct Line {
  ThrustCoefficient intercept;  ///< k at φ = 0 [N/(rad/s)²], positive; K_T only if the fit was anchored
  Real slope_per_rad = 0;       ///< N/(rad/s)² per rad, finite, usually negative
  std::optional<LineUncertainty> uncertainty{};
};

/// k at the speed ω is k(φ) (1 + per_rad_s (ω − reference)), the bracket held within kMost of 1. On small propellers it
/// rises by a fifth over the speeds of a sweep.
struct SpeedTrend {
  static constexpr Real kMost = Real(0.3);
  Real per_rad_s = 0;   ///< 0: k does not depend on the speed
  RadPerSec reference;  ///< where k is k(φ) [rad/s], positive

  [[nodiscard]] Real factor_at(Real speed) const noexcept;
  /// The speed [rad/s] with the thrust that `plain` would have without the trend. Within 1e-9 of itself where k changes
  /// by a fifth up to there; in double.
  [[nodiscard]] Real speed_for(Real plain) const noexcept;
};

/// What a curve is made of, wherever its knots are: for what takes it over without a copy.
struct CurveParts {
  ThrustCoefficient thrust_coefficient;  ///< K_T
  ThrustCoefficient intercept;           ///< of the line; does not count where `k` has knots
  Real slope_per_rad = 0;
  Radians largest_fitted;
  OverlapMeasure overlap = OverlapMeasure::rim_arc;
  KnotList k{};       ///< without any: the line
  KnotList torque{};  ///< without any: 1 everywhere
  SpeedTrend speed_trend{};
};

/// Whether a ThrustCurve can be made of it.
[[nodiscard]] bool sound(const CurveParts& parts) noexcept;

/// k_i of this k. `clamped` is in [kScalingFloor, 1] whatever φ is, 1 if φ is NaN; `published` is what the formula
/// gives.
[[nodiscard]] Real scaling_factor_of(Real k, Real thrust_coefficient, Radians occlusion_angle, ScalingLaw law) noexcept;

/// Within [1/kMostTorque, kMostTorque].
[[nodiscard]] inline Real held_torque_share(Real share) noexcept {
  return std::min(kMostTorque, std::max(1 / kMostTorque, share));
}

/// T = k(φ) ω². A ThrustCurve that exists is valid.
class ThrustCurve {
 public:
  /// `thrust_coefficient` is K_T, measured without occlusion; the line need not pass through it. `overlap` is how the φ
  /// of the fit is measured. nullopt unless K_T and the intercept are positive, the slope [N/(rad/s)² per rad] finite,
  /// `largest_fitted`, the widest occlusion behind the line, in (0, 2π], and the uncertainty, if given, finite with
  /// variances not negative.
  [[nodiscard]] static std::optional<ThrustCurve> from_line(
      ThrustCoefficient thrust_coefficient, ThrustCoefficient intercept, Real slope_per_rad, Radians largest_fitted,
      OverlapMeasure overlap = OverlapMeasure::rim_arc,
      const std::optional<LineUncertainty>& uncertainty = std::nullopt) noexcept;
  /// k [N/(rad/s)²] at its knots, K_T the first of them: for a propeller that follows no line. nullopt unless the table
  /// holds positive k that do not rise, and `largest_fitted` is in (0, 2π].
  [[nodiscard]] static std::optional<ThrustCurve> from_table(const OcclusionTable& k, Radians largest_fitted,
                                                             OverlapMeasure overlap = OverlapMeasure::rim_arc) noexcept;

  /// False, and nothing is changed, unless the numbers are finite, the reference positive and the change down to rest,
  /// per_rad_s · reference, at most SpeedTrend::kMost.
  bool set_speed_trend(const SpeedTrend& trend) noexcept;
  [[nodiscard]] const SpeedTrend& speed_trend() const noexcept { return speed_trend_; }

  /// Drag torque at φ as a share of that without occlusion, at one and the same speed. False, and nothing is changed,
  /// unless each is in (0, kMostTorque). Without it the torque is taken not to depend on φ.
  bool set_torque_share(const OcclusionTable& share) noexcept;
  [[nodiscard]] Real torque_share_at(Radians occlusion_angle) const noexcept {
    return torque_share_.empty() ? Real(1) : held_torque_share(torque_share_.at(occlusion_angle));
  }

  /// K_T [N/(rad/s)²], positive.
  [[nodiscard]] ThrustCoefficient thrust_coefficient() const noexcept { return thrust_coefficient_; }
  /// The widest occlusion behind the curve [rad], in (0, 2π].
  [[nodiscard]] Radians largest_fitted() const noexcept { return largest_fitted_; }
  /// How the φ of the fit is measured; the flight must measure it the same way.
  [[nodiscard]] OverlapMeasure overlap() const noexcept { return overlap_; }

  /// Calls `of_line(const Line&)` or `of_table(const OcclusionTable&)`, for whatever writes or prints the parameters,
  /// and returns what it returns.
  template <class OfLine, class OfTable>
  decltype(auto) visit(OfLine&& of_line, OfTable&& of_table) const {
    return table_.empty() ? of_line(line_) : of_table(table_);
  }
  /// As long as the curve lives.
  [[nodiscard]] CurveParts parts() const noexcept;
  [[nodiscard]] bool has_uncertainty() const noexcept;

  /// k(φ), also beyond the largest fitted angle, where it may be negative.
  [[nodiscard]] ThrustCoefficient at(Radians occlusion_angle) const noexcept {
    if (!table_.empty()) return ThrustCoefficient(table_.at(occlusion_angle));
    return line_.intercept + ThrustCoefficient(line_.slope_per_rad * occlusion_angle.value());
  }
  /// Standard uncertainty of k(φ) [N/(rad/s)²]; +∞ if unknown.
  [[nodiscard]] Real standard_error_at(Radians occlusion_angle) const noexcept;
  /// The part of it by which k may bend away between two knots of a table; 0 of a line.
  [[nodiscard]] Real bend_error_at(Radians occlusion_angle) const noexcept {
    return table_.empty() ? Real(0) : table_.bend_error_at(occlusion_angle);
  }
  /// As scaling_factor_of(), with k(φ).
  [[nodiscard]] Real scaling_factor(Radians occlusion_angle, ScalingLaw law = ScalingLaw::clamped) const noexcept {
    return scaling_factor_of(at(occlusion_angle).value(), thrust_coefficient_.value(), occlusion_angle, law);
  }
  /// Standard uncertainty of K_T k_i relative to itself, from K_T, the curve and the angle's own `angle_uncertainty`;
  /// the speed ω = sqrt(T/(K_T k_i)) has half of it. Where k_i is held at 1 it is K_T's alone. K_T and the curve count
  /// as independent. +∞ where none can be given: no uncertainty known, k_i at its floor or below, φ NaN.
  [[nodiscard]] Real relative_uncertainty(Radians occlusion_angle, Radians angle_uncertainty,
                                          ScalingLaw law = ScalingLaw::clamped) const noexcept;

  /// The curve raised by `raised` everywhere, with what it changes over φ times `steepness`; K_T and everything else
  /// stays. nullopt if k(0) is not positive then.
  [[nodiscard]] std::optional<ThrustCurve> perturbed(ThrustCoefficient raised, Real steepness) const noexcept;

 private:
  ThrustCurve(ThrustCoefficient thrust_coefficient, const Line& line, Radians largest_fitted,
              OverlapMeasure overlap) noexcept
      : thrust_coefficient_(thrust_coefficient), line_(line), largest_fitted_(largest_fitted), overlap_(overlap) {}

  ThrustCoefficient thrust_coefficient_;
  Line line_;             // counts if table_ is empty
  OcclusionTable table_;  // of k
  OcclusionTable torque_share_;
  SpeedTrend speed_trend_;
  Radians largest_fitted_;
  OverlapMeasure overlap_;
};

}  // namespace kphi::compensation
