// What flies of the curves of all rotors: k(φ), torque and speed trend, without what only the ground asks (their
// uncertainties). The knots of all tables share one store, and equal tables one place in it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "compensation/rotors.hpp"
#include "compensation/thrust_curve.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// In the order of the rotors. Plain data.
class FlownCurves {
 public:
  /// Of all tables that differ, those of k and of torque shares together.
  static constexpr std::size_t kMostKnots = 96;

  /// Of the next rotor; `curve` must be sound(). False, and nothing is added, if there are kMostRotors already or the
  /// knots are too many.
  bool add(const CurveParts& curve) noexcept;

  void clear() noexcept { curves_.resize(0); }
  [[nodiscard]] std::size_t size() const noexcept { return curves_.size(); }
  /// K_T [N/(rad/s)²].
  [[nodiscard]] Real thrust_coefficient(std::size_t rotor) const noexcept { return curves_[rotor].thrust_coefficient; }
  [[nodiscard]] Radians largest_fitted(std::size_t rotor) const noexcept { return curves_[rotor].largest_fitted; }
  [[nodiscard]] const SpeedTrend& speed_trend(std::size_t rotor) const noexcept { return curves_[rotor].speed_trend; }
  /// k(φ) [N/(rad/s)²], as ThrustCurve::at.
  [[nodiscard]] Real k_at(std::size_t rotor, Radians occlusion_angle) const noexcept;
  /// As ThrustCurve::torque_share_at.
  [[nodiscard]] Real torque_share_at(std::size_t rotor, Radians occlusion_angle) const noexcept;

 private:
  struct Piece {
    std::uint8_t first = 0, count = 0;
  };
  struct Curve {
    Real thrust_coefficient, intercept, slope_per_rad;
    Radians largest_fitted;
    SpeedTrend speed_trend;
    Piece k, torque;  // none: the line, and 1
  };
  struct FlownKnot {
    Radians occlusion;
    Real value;
  };
  /// Stores these knots, once for all curves that have them, and points `piece` at them; false: no room left.
  bool place(const KnotList& knots, Piece& piece) noexcept;

  Rotors<Curve> curves_;
  FlownKnot knots_[kMostKnots] = {};
  std::uint8_t knot_count_ = 0;
};

}  // namespace kphi::compensation
