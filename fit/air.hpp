// Thrust is proportional to the density of the air: k as it would be in standard air.
#pragma once

#include <optional>
#include <span>

#include "results/step_mean.hpp"

namespace kphi::fit {

inline constexpr double kStandardDensity = 1.225;  ///< kg/m³: ISA at sea level

struct AirDensity {
  double kg_m3 = 0;
  double u_kg_m3 = 0;  ///< standard uncertainty, shared by all steps
};

/// Mean over the steps; nothing when one of them does not know its air: it is never taken for standard.
[[nodiscard]] std::optional<AirDensity> air_of(std::span<const results::StepMean> steps);

struct StandardCoefficient {
  double k = 0;  ///< N/(rad/s)² at kStandardDensity
  double standard_error = 0;
};

/// k · 1.225/ρ; the error of the density joins that of k (JCGM 100, eq. 12).
[[nodiscard]] StandardCoefficient at_standard(double k, double standard_error, const AirDensity& air);

}  // namespace kphi::fit
