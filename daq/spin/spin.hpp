// The motor turned by hand, before anybody trusts a campaign to it: the same guard, limits and record as a run.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "daq/bench/bench.hpp"
#include "daq/campaign/operator.hpp"
#include "daq/run/progress.hpp"
#include "daq/run/run.hpp"
#include "daq/spin/hand_control.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {

struct Spin {
  Bench& bench;
  const profiles::Campaign& campaign;  ///< propeller, limits, slew; its steps do not count
  const profiles::BenchConfig& config;
  Operator& person;
  Progress& progress;
  const std::function<bool()>& stop_asked;
  HandControl::Settings speeds;
  Keys& keys;
  std::filesystem::path file;
};

struct SpinResult {
  RunResult run;
  std::vector<results::StepMean> held;  ///< one for each speed that was held for longer than is discarded
};

/// Asks whether the stand is clear, then turns the motor until the time is over, a key or nobody at the keys says stop.
/// From the answer on a stop key counts: before the motor turns it ends this as Interrupted.
/// Throws as record_run.
[[nodiscard]] SpinResult spin_by_hand(const Spin& spin);

}  // namespace kphi::daq
