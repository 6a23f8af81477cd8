// Campaigns on the deterministic bench whose motor hangs on the simulated supply.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "daq/campaign/campaign_run.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/campaign_folder.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace supply_campaign_test {

using testing::HasSubstr;
using testing::ThrowsMessage;

class NoteMotor final : public Progress {
 public:
  void tick(const Position& position, const Observation&) override {
    if (act) act(position);
  }
  std::function<void(const Position&)> act;
};

class SupplyCampaign : public testing::Test {
 protected:
  CampaignResult run(double current_limit_a = 50) {
    config_ = test::with_supply(test::deterministic_config(4), current_limit_a);
    bench_.emplace(config_);
    results_.emplace(results::CampaignFolder::create(folder_.path(), "u", "c"));
    AutoConfirmOperator person;
    return run_campaign(*bench_, campaign_, config_, *results_, person, progress_, [] { return false; });
  }
  /// From now on; `count` answers, or 0: all of a minute.
  void spoil(sim::FaultKind kind, std::uint64_t count) {
    sim::Fault fault;
    fault.kind = kind;
    fault.at = bench_->clock().now();
    fault.lasts = std::chrono::minutes(1);
    fault.count = count;
    bench_->simulation().supply()->add_fault(fault);
  }
  sim::SupplyCircuit& circuit() { return bench_->simulation().supply()->circuit(); }
  [[nodiscard]] results::RunRecording aborted() const {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_.path())) {
      if (entry.path().string().ends_with(".aborted.h5")) return results::read_run(entry.path());
    }
    ADD_FAILURE() << "no aborted run";
    return {};
  }
  /// Runs into `reason`, after `act` was done in the middle of the third step; then what every safety stop must leave
  /// is held.
  void expect_stop(double limit_a, std::function<void()> act, const std::string& reason) {
    int ticks = 0;
    progress_.act = [&](const Position& position) {
      if (position.step == 2 && ++ticks == 30) act();
    };
    EXPECT_THAT([&] { (void)run(limit_a); }, ThrowsMessage<SafetyStop>(HasSubstr(reason))) << "nothing stopped the run";
    EXPECT_FALSE(circuit().output());
    bench_->wait_until(bench_->clock().now() + std::chrono::milliseconds(200));
    EXPECT_EQ(bench_->simulation().motor().stage().mode, sim::PowerStage::Mode::coast);
    const results::RunRecording kept = aborted();
    EXPECT_THAT(kept.outcome_reason, HasSubstr(reason));
    EXPECT_GT(kept.load_cell.size(), 5000u);
    EXPECT_GT(kept.supply.size(), 3u);
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign("0, 90");
  profiles::BenchConfig config_;
  std::optional<DeterministicBench> bench_;
  std::optional<results::CampaignFolder> results_;
  NoteMotor progress_;
};

TEST_F(SupplyCampaign, RecordsWhatTheSupplyShows) {
  const CampaignResult result = run();
  EXPECT_EQ(result.runs, 2);
  EXPECT_EQ(result.flagged_steps, 0);
  const auto recording = results::read_run(results_->complete_runs(campaign_.occlusions_deg).at(0));
  EXPECT_EQ(recording.header.supply_identity, "simulated supply");
  ASSERT_GT(recording.supply.size(), 8u);
  for (const auto& reading : recording.supply) {
    EXPECT_EQ(reading.output, 1u);
    EXPECT_EQ(reading.set_voltage_v, 12);
    EXPECT_EQ(reading.current_limit_a, 50);
  }
  EXPECT_TRUE(results::verify_run(results_->complete_runs(campaign_.occlusions_deg).at(0)).whole());
}

TEST_F(SupplyCampaign, GivesPowerPerStepAsTheModuleSawIt) {
  (void)run();
  const auto steps = results::read_steps(results_->steps());
  ASSERT_EQ(steps.size(), 8u);
  for (const auto& step : steps) {
    EXPECT_NEAR(step.supply_a, step.supply_current_a, 0.1 * step.supply_current_a + 0.1) << step.step;
    EXPECT_NEAR(step.supply_v, 12 - 0.020 * step.supply_a, 0.02) << step.step;
    EXPECT_NEAR(step.supply_w, step.supply_v * step.supply_a, 0.02 * step.supply_w) << step.step;
    EXPECT_NEAR(step.supply_voltage_v, step.supply_v, 0.1) << "one circuit";
  }
  EXPECT_GT(steps[3].supply_w, 3 * steps[0].supply_w);
}

TEST_F(SupplyCampaign, StepsWithoutASupplyHaveNoSuchColumns) {
  results::StepMean step;
  EXPECT_THAT(results::format_steps({&step, 1}), testing::Not(HasSubstr("supply_w")));
  step.supply_v = step.supply_a = step.supply_w = 2;
  EXPECT_THAT(results::format_steps({&step, 1}), HasSubstr(",quality_flags,supply_v,supply_a,supply_w\n"));
}

TEST_F(SupplyCampaign, StopsWhenTheSupplyLimitsTheCurrent) {
  expect_stop(
      50, [&] { circuit().controls().amps = 0.9 * circuit().amps(); }, "current limit reached");
}

TEST_F(SupplyCampaign, StopsWhenItsProtectionTrips) {
  expect_stop(
      50, [&] { circuit().trip(SupplyProtection::over_voltage); }, "over-voltage protection switched the output off");
}

TEST_F(SupplyCampaign, StopsWhenSomebodyTurnsTheKnob) {
  expect_stop(
      50, [&] { circuit().controls().volts = 11.8; }, "changed on the front panel");
}

TEST_F(SupplyCampaign, StopsWhenTheSupplyNoLongerAnswersAndSaysThatItMayBeOn) {
  bool closed = false;
  progress_.act = [&](const Position& position) {
    if (position.step == 0 && !std::exchange(closed, true)) spoil(sim::FaultKind::supply_closed, 0);
  };
  EXPECT_THAT([&] { (void)run(); },
              ThrowsMessage<SafetyStop>(testing::AllOf(testing::StartsWith("supply:"), HasSubstr("it may be ON"))))
      << "nobody missed the supply";
  bench_->wait_until(bench_->clock().now() + std::chrono::milliseconds(200));
  EXPECT_EQ(bench_->simulation().motor().stage().mode, sim::PowerStage::Mode::coast);
}

TEST_F(SupplyCampaign, BearsAnAnswerThatIsLost) {
  bool lost = false;
  progress_.act = [&](const Position& position) {
    if (position.step == 1 && !std::exchange(lost, true)) spoil(sim::FaultKind::supply_bad_crc, 2);
  };
  EXPECT_EQ(run().flagged_steps, 0);
}

TEST_F(SupplyCampaign, IsTheSameForTheSameSeed) {
  (void)run();
  const std::string first = results::read_text(results_->steps());
  std::filesystem::remove_all(results_->path());
  (void)run();
  EXPECT_EQ(results::read_text(results_->steps()), first);
}

TEST_F(SupplyCampaign, CoastsWithinAFifthOfASecondOfTheReading) {
  expect_stop(
      50, [&] { circuit().trip(SupplyProtection::over_current); }, "over-current");
  const results::RunRecording kept = aborted();
  const auto first = std::find_if(kept.supply.begin(), kept.supply.end(), [](const auto& r) { return r.output == 0; });
  ASSERT_NE(first, kept.supply.end());
  // The motor was let go before the stream ended, and the bridge is open soon after (expect_stop).
  EXPECT_LT(kept.load_cell.back().arrival_ns - first->time_ns, 200'000'000);
}

/// At the prompt: acts, then lets time pass, with or without looking at the guard.
class MeddlingOperator final : public Operator {
 public:
  std::function<void()> act;
  DeterministicBench* bench = nullptr;
  bool looks = true;

 protected:
  void mount(const profiles::Propeller&, double, const std::string&) override {
    act();
    for (int i = 0; i < 60; ++i) {
      bench->wait_until(bench->clock().now() + std::chrono::milliseconds(10));
      if (looks) poll();
    }
  }
};

class AtTheStand : public SupplyCampaign {
 protected:
  AtTheStand() {
    config_ = test::with_supply(test::deterministic_config(4));
    bench_.emplace(config_);
    results_.emplace(results::CampaignFolder::create(folder_.path(), "u", "c"));
    person_.bench = &*bench_;
  }
  void run_with_person() {
    (void)run_campaign(*bench_, campaign_, config_, *results_, person_, progress_, [] { return false; });
  }
  MeddlingOperator person_;
};

TEST_F(AtTheStand, AnOutputThatComesOnUnaskedIsASafetyStopWhetherOrNotThePromptNotices) {
  person_.act = [this] { circuit().switch_output(true); };
  for (const bool looks : {true, false}) {
    person_.looks = looks;
    EXPECT_THAT([&] { run_with_person(); },
                testing::ThrowsMessage<SafetyStop>(HasSubstr("output is on while somebody may be near")));
    EXPECT_FALSE(circuit().output());
    if (!looks) break;
    results_.emplace(results::CampaignFolder::create(folder_.path(), "u", "again"));
    bench_->restore_power();
  }
}

TEST_F(AtTheStand, NobodyIsAskedToComeNearBeforeTheRotorIsAtRestWithoutPower) {
  campaign_ = test::short_campaign("0", 1, 2);
  bench_->motor().spin_at(from_rpm(6000));
  bench_->wait_until(bench_->clock().now() + std::chrono::seconds(1));
  bench_->motor().emergency_stop();
  double speed = 1e9;
  person_.act = [&] {
    speed = std::abs(bench_->simulation().plant().motor().speed);
    EXPECT_FALSE(circuit().output());
  };
  run_with_person();
  EXPECT_LT(speed, 10);
}

}  // namespace supply_campaign_test
}  // namespace kphi::daq
