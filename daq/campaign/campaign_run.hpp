// A whole campaign: mountings, runs, step means, journal, in one folder.
#pragma once

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "daq/audit/bench_audit.hpp"
#include "daq/bench/bench.hpp"
#include "daq/campaign/operator.hpp"
#include "daq/run/progress.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"
#include "results/step_mean.hpp"
#include "results/steps_csv.hpp"

namespace kphi::daq {

struct Resumption;

/// Whether to wait before the next run, with hysteresis: a pause begins above `pause_above` and ends below
/// `resume_below`. NaN begins a pause and never ends one.
struct CoolingRule {
  double pause_above_degc = std::numeric_limits<double>::infinity();
  double resume_below_degc = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool pauses(bool pausing, double coil_temperature_degc) const {
    return pausing ? !(coil_temperature_degc < resume_below_degc) : !(coil_temperature_degc <= pause_above_degc);
  }
};

struct CampaignResult {
  int runs = 0;  ///< all accepted ones, those from before a resumption included
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;  ///< in the network and in this host
  results::FlaggedSteps steps{};
};

/// One line on what the steps so far tell, or none; called after each accepted run, by the runner's thread, while the
/// motor is at rest. Must not throw.
using SoFar = std::function<std::string(std::span<const results::StepMean>)>;

/// Runs everything in order into `folder`. Each finished run is hashed in the journal and its step means are in
/// steps.csv before the next begins. Throws what record_run and Operator::mount throw; the journal then holds why.
/// `resumption`: of an existing folder. Its accepted runs stay as they are, unfinished runs are renamed, steps.csv and
/// means.csv are written again, and only the missing runs are made. Throws ConfigurationError if devices, files or
/// program changed.
[[nodiscard]] CampaignResult run_campaign(Bench& bench, const profiles::Campaign& campaign,
                                          const profiles::BenchConfig& config, const results::CampaignFolder& folder,
                                          Operator& person, Progress& progress, const std::function<bool()>& stop_asked,
                                          const Resumption* resumption = nullptr,
                                          const std::vector<BenchFinding>* audited = nullptr, const SoFar& so_far = {});

}  // namespace kphi::daq
