// steps.csv and means.csv of a campaign: always of all runs that are accepted so far, in the order in which `kphi
// replay` makes them again, whatever the order of the runs was.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "results/campaign_folder.hpp"
#include "results/records.hpp"
#include "results/steps_csv.hpp"

namespace kphi::daq {

class StepTables {
 public:
  /// `occlusions_deg` as the campaign lists them; the folder outlives this.
  StepTables(const results::CampaignFolder& folder, std::vector<double> occlusions_deg)
      : folder_(folder), occlusions_deg_(std::move(occlusions_deg)) {}
  void add(const std::filesystem::path& run, std::vector<results::StepMean> steps) {
    steps_[run.filename().string()] = std::move(steps);
  }
  /// Throws RecordError.
  void write(results::FileLayer& files) const;

 private:
  const results::CampaignFolder& folder_;
  const std::vector<double> occlusions_deg_;
  std::map<std::string, std::vector<results::StepMean>> steps_;  ///< by the run's file name
};

}  // namespace kphi::daq
