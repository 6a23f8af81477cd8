// The load cell's box against the campaign, before anything turns.
#pragma once

#include <vector>

#include "daq/bench.hpp"
#include "drivers/netbox/audit.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// Speeds and blades of the campaign, the largest thrust that its limits let pass, rate and buffer of the bench file.
[[nodiscard]] netbox::Intention intention_of(const profiles::Campaign& campaign, const profiles::Bench& place);

/// Worst first, faults included; see bench_audit.hpp.
[[nodiscard]] std::vector<netbox::Finding> audit_load_cell(const LoadCellLink& cell, const profiles::Campaign& campaign,
                                                           const profiles::Bench& place);

/// Throws ConfigurationError that names all faults with their remedies, if there are any.
void refuse_unsuitable(const LoadCellLink& cell, const profiles::Campaign& campaign, const profiles::Bench& place);

/// What of the settings the bench file asks for is not so in the box; rate and buffer are the audit's.
[[nodiscard]] std::vector<netbox::Finding> unset(const netbox::Configuration& box,
                                                 const profiles::NetBoxSettings& wanted);

}  // namespace kphi::daq
