#include "daq/step_tables.hpp"

#include "daq/repetitions.hpp"

namespace kphi::daq {

void StepTables::write(results::FileLayer& files) const {
  std::vector<results::StepMean> all;
  for (const auto& run : folder_.complete_runs(occlusions_deg_)) {
    const auto found = steps_.find(run.filename().string());
    if (found != steps_.end()) all.insert(all.end(), found->second.begin(), found->second.end());
  }
  results::write_steps(folder_.steps(), all, files);
  results::write_steps(folder_.means(), average_repetitions(all), files);
}

}  // namespace kphi::daq
