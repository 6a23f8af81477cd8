#include "daq/deterministic_bench.hpp"
#include "daq/live_bench.hpp"
#include "daq/runs_apart.hpp"

namespace kphi::daq {

std::unique_ptr<Bench> connect(const profiles::Bench& place, const std::function<bool()>& stop_asked) {
  if (place.simulation && place.simulation->in_process) {
    // A script of faults speaks of one bench that lives through the whole campaign.
    if (!place.simulation->faults.empty()) return std::make_unique<DeterministicBench>(place);
    return std::make_unique<RunsApart>(place);
  }
  return std::make_unique<LiveBench>(place, stop_asked);
}

}  // namespace kphi::daq
