// What the thrust of a step costs.
#pragma once

#include <span>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::fit {

/// Mean over the repetitions of one step at one occlusion.
struct StepPower {
  double phi_deg = 0;
  int step = 0;
  double speed_rad_s = 0;
  double thrust_n = 0;
  double power_w = 0;      ///< electrical
  bool by_supply = false;  ///< measured by the bench supply; else by the module

  [[nodiscard]] double newton_per_watt() const noexcept { return thrust_n / power_w; }
  [[nodiscard]] double gram_per_watt() const noexcept { return newton_per_watt() / 9.80665e-3; }
};

/// By φ, then step; without steps whose power nobody measured.
[[nodiscard]] std::vector<StepPower> power_of(std::span<const results::StepMean> steps);

}  // namespace kphi::fit
