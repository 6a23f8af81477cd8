// Every device of the bench against the campaign, before a folder is made and anything turns: one way of being told.
#pragma once

#include <string>
#include <vector>

#include "daq/bench.hpp"
#include "drivers/finding.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

struct BenchFinding {
  std::string device;  ///< "load cell", "motor"
  Finding finding;

  /// "motor: warning: … ; the next move".
  [[nodiscard]] std::string line() const { return device + ": " + finding.line(); }
};

/// What is worth a word: device by device, worst first, no faults. Faults throw one ConfigurationError that names them
/// all with their remedies.
[[nodiscard]] std::vector<BenchFinding> audit_bench(Bench& bench, const profiles::Campaign& campaign,
                                                    const profiles::Bench& place);

}  // namespace kphi::daq
