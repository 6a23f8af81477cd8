// For a vehicle whose motors take a throttle and no speed.
#pragma once

#include <cmath>

#include "compensation/units.hpp"

namespace kphi::compensation {

/// Thrust over throttle u in [0, 1] of a propeller that nothing covers: T = full (square_share u² + (1 − square_share)
/// u). square_share is PX4's THR_MDL_FAC; 1 is T ~ u², 0 a straight line. Ask it for Compensator::uncovered_thrusts.
struct ThrottleCurve {
  Newtons full;           ///< at u = 1, at the voltage of now; positive
  Real square_share = 1;  ///< in [0, 1]

  /// u, held within [0, 1]; 0 where the thrust is NaN.
  [[nodiscard]] Real throttle_for(Newtons thrust) const noexcept {
    const Real asked = thrust.value();
    if (is_nan(asked)) return 0;
    const Real share = asked / full.value(), straight = 1 - square_share;
    if (share <= 0) return 0;
    if (share >= 1) return 1;
    // The root in the form that stays good for a straight line.
    return 2 * share / (straight + std::sqrt(straight * straight + 4 * square_share * share));
  }
};

}  // namespace kphi::compensation
