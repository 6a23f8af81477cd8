// Checks every device of the bench against the campaign before a folder is made and anything turns.
#pragma once

#include <string>
#include <vector>

#include "base/finding.hpp"
#include "daq/bench/bench.hpp"
#include "daq/guard/guard_limits.hpp"
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

}  // namespace kphi::daq
