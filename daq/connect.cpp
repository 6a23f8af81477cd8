#include "daq/deterministic_bench.hpp"
#include "daq/live_bench.hpp"

namespace kphi::daq {

std::unique_ptr<Bench> connect(const profiles::Bench& place) {
  if (place.simulation && place.simulation->in_process) return std::make_unique<DeterministicBench>(place);
  return std::make_unique<LiveBench>(place);
}

}  // namespace kphi::daq
