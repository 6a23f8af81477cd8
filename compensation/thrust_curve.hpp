// k(φ) of one propeller, as fitted on the bench (paper, Fig. 5 and equation 4): the one type that all code after the
// fit asks. Its form, today a line, is its own affair: only what writes or prints the parameters calls visit(), with a
// function for each form, so that where another form is missing does not compile.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "compensation/convex_polygon.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// How k(φ) becomes the scaling factor k_i of ω = sqrt(T / (K_T k_i)).
enum class ScalingLaw : std::uint8_t {
  clamped,  ///< k(φ)/K_T held in [kScalingFloor, 1], exactly 1 at φ = 0: never slows a propeller down, never diverges
  published,  ///< 1 − |K_T − k(φ)|/K_T, equation 4 to the letter: below 1 also where the curve lies above K_T
};

/// The smallest k_i of ScalingLaw::clamped: the speed is raised by 1/sqrt(0.1) = 3.16 at most.
inline constexpr Real kScalingFloor = Real(0.1);

/// How well K_T and the line are known, one standard deviation, SI.
struct LineUncertainty {
  Real thrust_coefficient = 0;  ///< of K_T [N/(rad/s)²]
  Real intercept_variance = 0;  ///< of the line, [N/(rad/s)²]²
  Real covariance = 0;          ///< of intercept and slope, per rad
  Real slope_variance = 0;      ///< per rad²
};

/// k(φ) = intercept + slope φ.
struct Line {
  ThrustCoefficient intercept;  ///< k at φ = 0 [N/(rad/s)²], positive; K_T only if the fit was anchored
  Real slope_per_rad = 0;       ///< N/(rad/s)² per rad, finite, usually negative
  std::optional<LineUncertainty> uncertainty{};
};

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

  /// K_T [N/(rad/s)²], positive.
  [[nodiscard]] ThrustCoefficient thrust_coefficient() const noexcept { return thrust_coefficient_; }
  /// The widest occlusion behind the curve [rad], in (0, 2π].
  [[nodiscard]] Radians largest_fitted() const noexcept { return largest_fitted_; }
  /// How the φ of the fit is measured; the flight must measure it the same way.
  [[nodiscard]] OverlapMeasure overlap() const noexcept { return overlap_; }

  /// Calls `of_form(const Line&)`, for whatever writes or prints the parameters, and returns what it returns.
  template <class OfForm>
  decltype(auto) visit(OfForm&& of_form) const {
    return of_form(line_);
  }
  [[nodiscard]] bool has_uncertainty() const noexcept { return line_.uncertainty.has_value(); }

  /// k(φ), also beyond the largest fitted angle, where it may be negative.
  [[nodiscard]] ThrustCoefficient at(Radians occlusion_angle) const noexcept {
    return line_.intercept + ThrustCoefficient(line_.slope_per_rad * occlusion_angle.value());
  }
  /// Standard uncertainty of k(φ) [N/(rad/s)²]; +∞ if unknown.
  [[nodiscard]] Real standard_error_at(Radians occlusion_angle) const noexcept;
  /// k_i. `clamped` is in [kScalingFloor, 1] whatever φ is, 1 if φ is NaN; `published` is what the formula gives.
  [[nodiscard]] Real scaling_factor(Radians occlusion_angle, ScalingLaw law = ScalingLaw::clamped) const noexcept {
    const Real reference = thrust_coefficient_.value();
    const Real k = at(occlusion_angle).value();
    if (law == ScalingLaw::published) return 1 - std::fabs(reference - k) / reference;
    if (!(occlusion_angle.value() > 0)) return 1;
    return std::min(Real(1), std::max(kScalingFloor, k / reference));
  }
  /// Standard uncertainty of K_T k_i relative to itself, from K_T, the curve and the angle's own `angle_uncertainty`;
  /// the speed ω = sqrt(T/(K_T k_i)) has half of it. Where k_i is held at 1 it is K_T's alone. K_T and the curve count
  /// as independent. +∞ where none can be given: no uncertainty known, k_i at its floor or below, φ NaN.
  [[nodiscard]] Real relative_uncertainty(Radians occlusion_angle, Radians angle_uncertainty,
                                          ScalingLaw law = ScalingLaw::clamped) const noexcept;

  /// The curve raised by `raised` everywhere, with what it changes over φ times `steepness`; K_T and everything else
  /// stays. nullopt if k(0) is not positive then.
  [[nodiscard]] std::optional<ThrustCurve> perturbed(ThrustCoefficient raised, Real steepness) const noexcept {
    return from_line(thrust_coefficient_, line_.intercept + raised, line_.slope_per_rad * steepness, largest_fitted_,
                     overlap_, line_.uncertainty);
  }

 private:
  ThrustCurve(ThrustCoefficient thrust_coefficient, const Line& line, Radians largest_fitted,
              OverlapMeasure overlap) noexcept
      : thrust_coefficient_(thrust_coefficient), line_(line), largest_fitted_(largest_fitted), overlap_(overlap) {}

  ThrustCoefficient thrust_coefficient_;
  Line line_;
  Radians largest_fitted_;
  OverlapMeasure overlap_;
};

}  // namespace kphi::compensation
