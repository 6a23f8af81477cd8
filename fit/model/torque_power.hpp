// What thrust costs: torque, Q = k_Q(φ) ω² (science.md, eq. 1), and electrical power.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/model/identification.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// k_Q per φ, ascending, positive, and how it repeats: N m stand where a thrust has N.
struct TorqueFit {
  std::vector<OcclusionCoefficient> table;
  Repeatability repeatability;
};

/// Least squares through the origin; mountings as in `options`. nullopt if the steps have no torque, or no k_Q can be
/// fitted.
[[nodiscard]] std::optional<TorqueFit> fit_torque(std::span<const results::StepMean> steps,
                                                  const IdentificationOptions& options);

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
