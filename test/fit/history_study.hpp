// Campaigns of one propeller on one stand over time, simulated at the level of step means.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "fit/propellers/history.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {

/// `n` campaigns of the paper's kind, two days apart, on a stand with the same load cell, clock and barometer every
/// day. The thrust of campaign `at` is `factor` times what it should be; `between_runs`: scatter of k from run to run,
/// a share.
inline History simulated_history(std::size_t n, unsigned seed, std::size_t at, double factor,
                                 double between_runs = 0.003) {
  StudyTruth truth;
  truth.between_runs = between_runs;
  truth.clock = truth.calibration = truth.density = 0;
  std::vector<Fitted> campaigns;
  std::vector<std::string> names, when;
  for (std::size_t i = 0; i < n; ++i) {
    StudyCampaign campaign = study_campaign(truth, seed * 1000 + static_cast<unsigned>(i));
    if (i == at)
      for (results::StepMean& step : campaign.steps) step.thrust_n *= factor;
    campaigns.push_back(analysed(identify(campaign.steps)));
    names.push_back(fmt::format("c{}", i));
    when.push_back(fmt::format("2026-03-{:02}T10:00:00Z", 1 + 2 * i));
  }
  return history_of(campaigns, names, when);
}

}  // namespace kphi::fit
