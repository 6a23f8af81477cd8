// A short campaign on the deterministic bench, spoilt by a script.
#pragma once

#include "test/daq/campaign_on_bench.hpp"

namespace kphi::daq {

/// Zero at 0.2 s to 0.7 s, then four steps of 0.6 s to 3.1 s; two runs.
class FaultyCampaign : public CampaignOnBench {
 protected:
  CampaignResult run(const std::string& faults, int seed = 4) {
    const auto script = folder_.path() / "faults.yaml";
    std::ofstream(script) << "format: kphi-faults/1\nfaults:\n" << faults;
    config_ = test::deterministic_config(seed, script.string());
    if (otherwise_) otherwise_(config_);
    return CampaignOnBench::run();
  }
  /// Why the turning motor was stopped.
  std::string stop(const std::string& faults) {
    const std::string why = test::words_of<SafetyStop>([&] { return run(faults); });
    EXPECT_NE(why, "") << "went unnoticed: " << faults;
    EXPECT_TRUE(motor_is_let_go()) << faults;
    return why;
  }
  /// Of each step of a run.
  [[nodiscard]] std::vector<std::string> flags(std::size_t run) const {
    std::vector<std::string> names;
    for (const auto& step : reduce(recording(run))) names.push_back(results::quality_flag_names(step.quality_flags));
    return names;
  }
  [[nodiscard]] static std::vector<EventKind> events(const results::RunRecording& run) {
    std::vector<EventKind> kinds;
    for (const auto& event : run.events) kinds.push_back(event.kind);
    return kinds;
  }
  [[nodiscard]] std::vector<EventKind> events(std::size_t run) const { return events(recording(run)); }
  /// The path of the script is in the bench file, which is in the runs: one folder for all three.
  void expect_bytes_to_follow_from_the_seed(const std::string& faults) {
    const auto bytes = [&](int seed) {
      (void)run(faults, seed);
      return test::measured_in(*results_);
    };
    const auto once = bytes(9);
    EXPECT_TRUE(once == bytes(9));
    EXPECT_FALSE(once.begin()->second == bytes(10).begin()->second) << once.begin()->first;
  }

  const std::vector<std::string> kNoFlags{"", "", "", ""};
  std::function<void(profiles::BenchConfig&)> otherwise_;  ///< what the bench file says
};

}  // namespace kphi::daq
