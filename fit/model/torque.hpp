// The torque coefficient against the occlusion, Q = k_Q(φ) ω², by the estimators of the thrust: what yaw authority an
// occluded rotor keeps is measured, not assumed.
#pragma once

#include <span>
#include <vector>

#include "fit/numerics/hypothesis_test.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

struct TorqueCoefficient {
  double phi_deg = 0;
  Estimate k_q;      ///< N m/(rad/s)², magnitude
  double share = 1;  ///< of k_Q(0)
  double share_u = 0;
  Estimate drag_per_thrust_m;  ///< κ = k_Q/k, m: what the allocation of a rotor at this φ needs
};

/// One row per φ, ascending; empty when the steps hold no torque. `k` as identified, in the same order of φ.
[[nodiscard]] std::vector<TorqueCoefficient> identify_torque(std::span<const results::StepMean> steps,
                                                             std::span<const double> phis_deg,
                                                             std::span<const Estimate> k);

}  // namespace kphi::fit
