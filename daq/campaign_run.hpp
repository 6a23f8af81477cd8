// A whole campaign: mountings, runs, step means, journal, in one folder.
#pragma once

#include <functional>

#include "daq/bench.hpp"
#include "daq/operator.hpp"
#include "daq/progress.hpp"
#include "daq/resume.hpp"
#include "profiles/bench.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"

namespace kphi::daq {

struct CampaignResult {
  int runs = 0;  ///< all that are accepted, also those of the programs before that this one goes on for
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;  ///< in the network and in this host
  int steps = 0;
  int doubtful_steps = 0;
};

/// Runs everything in order into `folder`. Each finished run is hashed in the journal and its step means are in
/// steps.csv before the next begins. Throws what record_run and Operator::mount throw; the journal then holds why.
/// `resumption`: of a folder that is there already. Its accepted runs stay as they are, what was left behind gets
/// another name, steps.csv and means.csv are made again, and only the runs that are missing are made. Throws
/// ConfigurationError when devices, files or program are not what they were.
[[nodiscard]] CampaignResult run_campaign(Bench& bench, const profiles::Campaign& campaign,
                                          const profiles::Bench& place, const results::CampaignFolder& folder,
                                          Operator& person, Progress& progress, const std::function<bool()>& stop_asked,
                                          const Resumption* resumption = nullptr);

}  // namespace kphi::daq
