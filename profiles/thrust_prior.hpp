// The thrust to expect of a propeller before it was measured.
#pragma once

#include <optional>
#include <string>

#include "compensation/units.hpp"
#include "profiles/campaign.hpp"

namespace kphi::profiles {

/// The thrust to expect of a propeller that was never measured, without occlusion.
struct ThrustPrior {
  ThrustCoefficient low;
  ThrustCoefficient high;
  std::string source;
};

/// By diameter and number of blades; nullopt without a published measurement. A plausibility check, not a result.
[[nodiscard]] std::optional<ThrustPrior> thrust_prior(const Propeller& propeller);

}  // namespace kphi::profiles
