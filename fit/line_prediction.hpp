// What the line says at an angle, with the error of everything behind it.
#pragma once

#include <vector>

#include "fit/budget.hpp"

namespace kphi::fit {

/// At one φ of a grid.
struct LinePrediction {
  double phi_deg = 0;
  Budget k;               ///< of the line, N/(rad/s)²
  Budget scaling_factor;  ///< k_i = k/K_T as the clamped law has it (1 at most): what is common to all k cancels
  /// Relative standard uncertainty of ω̂ = sqrt(T/k) for a given T: half that of k. 1.
  double speed_u_share = 0;
  bool clipped = false;       ///< the line lies above K_T here, k_i is held at 1
  bool extrapolated = false;  ///< outside the occlusions that carry the line
};

}  // namespace kphi::fit
