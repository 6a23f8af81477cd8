// Campaigns on the deterministic bench.
#pragma once

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "base/error.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/journal.hpp"
#include "results/reduction/reduction.hpp"
#include "results/reduction/step_averages.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {

inline std::vector<results::StepMean> steps_of(const std::vector<std::filesystem::path>& runs) {
  std::vector<results::StepMean> steps;
  for (const auto& file : runs) {
    for (const auto& step : reduce(results::read_run(file))) steps.push_back(step);
  }
  return steps;
}

class CampaignOnBench : public testing::Test {
 protected:
  virtual void prepare() {
    bench_.emplace(config_);
    results_.emplace(results::CampaignFolder::create(folder_.path(), "20210530T000000Z", "c"));
  }
  /// From its beginning, in a folder of its own.
  CampaignResult run() {
    prepare();
    return go(*bench_, *results_);
  }
  CampaignResult run(profiles::Campaign campaign) {
    campaign_ = std::move(campaign);
    return run();
  }
  CampaignResult go(Bench& bench, const results::CampaignFolder& folder, const Resumption* resumption = nullptr) {
    return run_campaign(bench, campaign_, config_, folder, person_, said_, test::never, resumption);
  }
  /// Another simulated motor.
  void use_motor(const std::string& file) {
    std::ofstream(folder_.path() / "motor.yaml") << file;
    std::string text = config_.text;
    text.replace(text.find("in_process: true"), 16, "in_process: true, motor: motor.yaml");
    config_ = profiles::parse_bench(text, (folder_.path() / "bench.yaml").string());
  }

  [[nodiscard]] std::vector<std::filesystem::path> runs() const {
    return results_->complete_runs(campaign_.occlusions_deg);
  }
  [[nodiscard]] results::RunRecording recording(std::size_t i) const { return results::read_run(runs().at(i)); }
  [[nodiscard]] results::RunRecording aborted() const { return results::read_run(results_->other_runs().at(0)); }
  [[nodiscard]] std::vector<results::StepMean> steps() const { return results::read_steps(results_->steps()); }
  [[nodiscard]] std::vector<results::StepMean> means() const { return results::read_steps(results_->means()); }
  [[nodiscard]] std::vector<results::JournalEntry> journal() const {
    return results::read_journal(results_->journal()).entries;
  }
  [[nodiscard]] std::vector<std::string> journaled() const {
    std::vector<std::string> names;
    for (const auto& entry : journal()) names.push_back(entry.event);
    return names;
  }
  /// Data of the entries of one event.
  [[nodiscard]] std::vector<nlohmann::json> journaled(const std::string& event) const {
    std::vector<nlohmann::json> found;
    for (const auto& entry : journal()) {
      if (entry.event == event) found.push_back(entry.data);
    }
    return found;
  }
  [[nodiscard]] bool motor_is_let_go() { return test::motor_is_let_go(*bench_); }
  /// Nothing is missing, and the tables are a pure function of the runs.
  void expect_whole() const {
    const auto found = results::verify_campaign(*results_);
    EXPECT_TRUE(found.whole()) << testing::PrintToString(found.problems);
    const auto again = steps_of(runs());
    EXPECT_EQ(test::bytes_of(results_->steps()), results::format_steps(again));
    EXPECT_EQ(test::bytes_of(results_->means()), results::format_steps(means_of(again)));
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign();
  profiles::BenchConfig config_ = test::deterministic_config(2);
  std::optional<DeterministicBench> bench_;
  std::optional<results::CampaignFolder> results_;
  test::ScriptedOperator person_;
  test::SaidLines said_;
};

}  // namespace kphi::daq
