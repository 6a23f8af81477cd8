// Probes the bench supply of a bench file: identity, readings, findings. Switches and sets nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/finding.hpp"
#include "drivers/supply/supply.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

struct SupplyProbe {
  std::optional<supply::Identity> identity;  ///< nullopt: no answer
  std::optional<supply::Reading> reading;
  std::vector<Finding> findings;
  [[nodiscard]] bool answers() const { return identity.has_value(); }
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// Throws ConfigurationError for an invalid URI.
[[nodiscard]] SupplyProbe probe_supply(const profiles::SupplyConfig& config, const Clock& clock);

/// Checks a reading against the bench file.
[[nodiscard]] std::vector<Finding> findings_of(const supply::Identity& identity, const supply::Reading& reading,
                                               const profiles::SupplyConfig& wanted);

}  // namespace kphi::daq
