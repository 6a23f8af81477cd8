// What one run is to do.
#pragma once

#include <filesystem>

#include "daq/run/mount_confirmation.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"

namespace kphi::daq {

struct RunOrder {
  const profiles::Campaign& campaign;
  const profiles::BenchConfig& config;
  MountConfirmation mounted;     ///< that somebody has confirmed it is what turns the motor's lock
  profiles::PlannedRun planned;  ///< its steps may be fewer than those of the plan
  double remaining_bench_s = 0;  ///< of the campaign, this run included
  std::filesystem::path file;    ///< final path
};

}  // namespace kphi::daq
