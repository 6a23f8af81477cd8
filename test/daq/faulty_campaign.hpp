// A short campaign on the deterministic bench, spoilt by a script.
#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {

/// Zero at 0.2 s to 0.7 s, then four steps of 0.6 s to 3.1 s; two runs.
class FaultyCampaign : public testing::Test {
 protected:
  CampaignResult run(const std::string& faults, int seed = 4) {
    const auto script = folder_.path() / "faults.yaml";
    std::ofstream(script) << "format: kphi-faults/1\nfaults:\n" << faults;
    config_ = test::deterministic_config(seed, script.string());
    bench_.emplace(config_);
    prepare(*bench_);
    results_.emplace(results::CampaignFolder::create(folder_.path(), "u", "c"));
    AutoConfirmOperator person;
    return run_campaign(*bench_, campaign_, config_, *results_, person, said_, [] { return false; });
  }
  virtual void prepare(DeterministicBench&) {}

  [[nodiscard]] results::RunRecording recording(std::size_t i) const {
    return results::read_run(results_->complete_runs(campaign_.occlusions_deg).at(i));
  }
  [[nodiscard]] std::vector<std::string> flags(std::size_t run) const {
    std::vector<std::string> names;
    for (const auto& step : reduce(recording(run))) names.push_back(results::quality_flag_names(step.quality_flags));
    return names;
  }
  [[nodiscard]] std::vector<EventKind> events(std::size_t run) const {
    std::vector<EventKind> kinds;
    for (const auto& event : recording(run).events) kinds.push_back(event.kind);
    return kinds;
  }
  [[nodiscard]] const sim::WireTruth& truth() { return bench_->simulation().wire().truth(); }
  [[nodiscard]] bool motor_is_let_go() { return test::motor_is_let_go(*bench_); }
  /// Step means of the whole campaign from the files alone are those that were stored.
  void expect_replay_agrees() const {
    std::vector<results::StepMean> again;
    for (const auto& file : results_->complete_runs(campaign_.occlusions_deg)) {
      for (const auto& step : reduce(results::read_run(file))) again.push_back(step);
    }
    EXPECT_EQ(results::format_steps(again), test::bytes_of(results_->steps()));
    EXPECT_TRUE(results::verify_campaign(*results_).whole())
        << testing::PrintToString(results::verify_campaign(*results_).problems);
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_;
  std::optional<DeterministicBench> bench_;
  std::optional<results::CampaignFolder> results_;
  test::SaidLines said_;
};

}  // namespace kphi::daq
