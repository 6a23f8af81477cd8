// The load cell's box against the campaign, before anything turns.
#pragma once

#include <vector>

#include "daq/bench/bench.hpp"
#include "drivers/netbox/receive/audit.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// Speeds, blades and thrust limit of the campaign, rate and buffer of the bench file.
[[nodiscard]] netbox::Intention intention_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config);

/// Worst first, faults included; see bench_audit.hpp.
[[nodiscard]] std::vector<netbox::Finding> audit_load_cell(const LoadCellLink& cell, const profiles::Campaign& campaign,
                                                           const profiles::BenchConfig& config);

/// Throws ConfigurationError with all faults and their remedies, if any.
void refuse_unsuitable(const LoadCellLink& cell, const profiles::Campaign& campaign,
                       const profiles::BenchConfig& config);

/// Settings of the bench file that the box does not have, except rate and buffer, which the audit checks.
[[nodiscard]] std::vector<netbox::Finding> unset(const netbox::Configuration& box,
                                                 const profiles::NetBoxSettings& wanted);

}  // namespace kphi::daq
