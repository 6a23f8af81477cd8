// Drag torque of the rotor, Q = k_Q(φ) ω² (science.md, eq. 1), with its budget (eq. 18 in newton metres): the yaw
// authority that an occluded rotor keeps is measured, not assumed.
#pragma once

#include <vector>

#include "fit/model/identification.hpp"
#include "fit/uncertainty/budget.hpp"

namespace kphi::fit {

struct TorqueCoefficient {
  double phi_deg = 0;
  Budget k_q;                  ///< N m/(rad/s)², magnitude
  Estimate share{1, 0};        ///< of k_Q(0); what all φ share cancels
  Estimate drag_per_thrust_m;  ///< κ = k_Q/k, m, for the control allocation of a rotor at this φ
};

/// One per row of the identification's table; empty if its steps have no torque. `bench` as for its thrust; a weighing
/// tells nothing of the torque, whose calibration is then assumed.
[[nodiscard]] std::vector<TorqueCoefficient> torque_coefficients(const Identification& identification,
                                                                 const BenchUncertainty& bench);

/// "k_Q        1.99e-08 ± 1.9e-10 N m/(rad/s)^2, 0.0128 ± 0.0001 m per newton of thrust": without occlusion; empty if
/// it was not measured.
[[nodiscard]] std::string torque_line(const std::vector<TorqueCoefficient>& torque);

}  // namespace kphi::fit
