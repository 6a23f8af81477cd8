// Checks the devices of a bench against the campaign, before a folder is made and anything turns.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/finding.hpp"
#include "daq/bench/bench.hpp"
#include "daq/guard/guard_limits.hpp"
#include "drivers/iq/service/audit.hpp"
#include "drivers/iq/session/connecting.hpp"
#include "drivers/netbox/receive/audit.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

struct BenchFinding {
  Source device = Source::motor;  ///< load_cell or motor
  Finding finding;

  /// "motor: warning: … ; the next move".
  [[nodiscard]] std::string line() const {
    return (device == Source::motor ? "motor: " : "load cell: ") + finding.line();
  }
};

/// Findings device by device, worst first, without faults: these throw one ConfigurationError that names them all with
/// their remedies.
[[nodiscard]] std::vector<BenchFinding> audit_bench(Bench& bench, const profiles::Campaign& campaign,
                                                    const profiles::BenchConfig& config);

/// The load cell alone: throws ConfigurationError for its faults.
void require_suitable(const LoadCellLink& cell, const profiles::Campaign& campaign,
                      const profiles::BenchConfig& config);

/// Speeds, blades and thrust limit of the campaign, rate and buffer of the bench file.
[[nodiscard]] netbox::Intention intention_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config);

/// From the client that `parameters` shows; nullopt without one or without an answer. Throws DeviceError.
[[nodiscard]] std::optional<Celsius> ask_coil_temperature(const iq::AuditRecord& parameters, const iq::Ask& ask);

}  // namespace kphi::daq
