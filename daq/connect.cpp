#include "daq/hardware/live_bench.hpp"
#include "daq/virtual/deterministic_bench.hpp"

namespace kphi::daq {

std::unique_ptr<Bench> connect(const profiles::BenchConfig& config, const std::function<bool()>& stop_asked) {
  if (config.simulation && config.simulation->in_process) {
    // A script of faults speaks of one bench that lives through the whole campaign.
    using Lives = DeterministicBench::Lives;
    const Lives lives = config.simulation->faults.empty() ? Lives::one_run : Lives::whole_campaign;
    return std::make_unique<DeterministicBench>(config, sim::BenchSettings{}, lives);
  }
  return std::make_unique<LiveBench>(config, stop_asked);
}

}  // namespace kphi::daq
