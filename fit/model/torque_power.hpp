// What thrust costs: torque, Q = k_Q(φ) ω² by the estimators of the thrust (the yaw authority that an occluded rotor
// keeps is measured, not assumed), and electrical power.
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
  Estimate drag_per_thrust_m;  ///< κ = k_Q/k, m, for the control allocation of a rotor at this φ
};

/// One row per φ, ascending; empty if the steps have no torque. `k` as identified, in the same order of φ.
[[nodiscard]] std::vector<TorqueCoefficient> identify_torque(std::span<const results::StepMean> steps,
                                                             std::span<const double> phis_deg,
                                                             std::span<const Estimate> k);

/// Mean over the repetitions of one step at one occlusion.
struct StepPower {
  double phi_deg = 0;
  int step = 0;
  double speed_rad_s = 0;
  double thrust_n = 0;
  double power_w = 0;      ///< electrical
  bool by_supply = false;  ///< true: measured by the bench supply; false: by the module

  [[nodiscard]] double newton_per_watt() const noexcept { return thrust_n / power_w; }
  [[nodiscard]] double gram_per_watt() const noexcept { return newton_per_watt() / 9.80665e-3; }
};

/// By φ, then step; without steps whose power was not measured.
[[nodiscard]] std::vector<StepPower> power_of(std::span<const results::StepMean> steps);

}  // namespace kphi::fit
