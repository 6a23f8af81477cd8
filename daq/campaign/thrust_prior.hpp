// The thrust to expect of a propeller before it was ever measured: a plausibility check, not a result.
#pragma once

#include <optional>
#include <string>

#include "compensation/units.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// Without occlusion.
struct ThrustPrior {
  ThrustCoefficient low;
  ThrustCoefficient high;
  std::string source;
  [[nodiscard]] static Newtons at(ThrustCoefficient k, RadPerSec speed) {
    return Newtons(k.value() * speed.value() * speed.value());
  }
};

/// By diameter and number of blades; nothing where no published measurement is known.
[[nodiscard]] std::optional<ThrustPrior> thrust_prior(const profiles::Propeller& propeller);

}  // namespace kphi::daq
