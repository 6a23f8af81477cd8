// A look at the bench supply of a bench file: who it is, what it shows, what is wrong. Switches and sets nothing.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/finding.hpp"
#include "drivers/supply/supply.hpp"
#include "profiles/supply_place.hpp"

namespace kphi::daq {

struct SupplyProbe {
  std::optional<supply::Identity> identity;  ///< none: it does not answer
  std::optional<supply::Reading> reading;
  std::vector<Finding> findings;
  [[nodiscard]] bool answers() const { return identity.has_value(); }
  [[nodiscard]] std::vector<std::string> lines() const;
};

/// Throws ConfigurationError for a URI that cannot be one.
[[nodiscard]] SupplyProbe probe_supply(const profiles::SupplyPlace& place, const Clock& clock);

/// What is wrong with this reading for what the bench file wants.
[[nodiscard]] std::vector<Finding> findings_of(const supply::Identity& identity, const supply::Reading& reading,
                                               const profiles::SupplyPlace& wanted);

}  // namespace kphi::daq
