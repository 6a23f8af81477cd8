// Campaigns on the deterministic bench whose motor hangs on the simulated supply.
#include <utility>

#include "test/daq/campaign_on_bench.hpp"

namespace kphi::daq {
namespace supply_campaign_test {

using testing::HasSubstr;
using testing::ThrowsMessage;

class SupplyCampaign : public CampaignOnBench {
 protected:
  SupplyCampaign() { config_ = test::with_supply(test::deterministic_config(4)); }
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
  void in_step(int step, std::function<void()> act, int tick = 1) {
    said_.at_tick = [=, ticks = 0](const Position& position, const Observation&) mutable {
      if (position.step == step && ++ticks == tick) act();
    };
  }
  void expect_coast() {
    bench_->wait_until(bench_->clock().now() + std::chrono::milliseconds(200));
    EXPECT_EQ(bench_->simulation().motor().stage().mode, sim::PowerStage::Mode::coast);
  }
  /// Runs into `reason`, after `act` was done in the middle of the third step; then what every safety stop must leave
  /// is held.
  void expect_stop(std::function<void()> act, const std::string& reason) {
    in_step(2, std::move(act), 30);
    EXPECT_THAT(test::words_of<SafetyStop>([&] { return run(); }), HasSubstr(reason));
    EXPECT_FALSE(circuit().output());
    expect_coast();
    EXPECT_THAT(aborted().outcome_reason, HasSubstr(reason));
    EXPECT_GT(aborted().load_cell.size(), 5000u);
    EXPECT_GT(aborted().supply.size(), 3u);
  }
};

TEST_F(SupplyCampaign, RecordsWhatTheSupplyShows) {
  const CampaignResult result = run();
  EXPECT_EQ(result.runs, 2);
  EXPECT_EQ(result.steps.flagged, 0);
  EXPECT_EQ(recording(0).header.supply_identity, "simulated supply");
  ASSERT_GT(recording(0).supply.size(), 8u);
  for (const auto& reading : recording(0).supply) {
    EXPECT_EQ(reading.output, 1u);
    EXPECT_EQ(reading.set_voltage_v, 12);
    EXPECT_EQ(reading.current_limit_a, 50);
  }
  EXPECT_TRUE(results::verify_run(runs().at(0)).whole());
}

TEST_F(SupplyCampaign, GivesPowerPerStepAsTheModuleSawItAndTheSameForTheSameSeed) {
  (void)run();
  const auto given = steps();
  ASSERT_EQ(given.size(), 8u);
  for (const auto& step : given) {
    EXPECT_NEAR(step.supply_a, step.supply_current_a, 0.1 * step.supply_current_a + 0.1) << step.step;
    EXPECT_NEAR(step.supply_v, 12 - 0.020 * step.supply_a, 0.02) << step.step;
    EXPECT_NEAR(step.supply_w, step.supply_v * step.supply_a, 0.02 * step.supply_w) << step.step;
    EXPECT_NEAR(step.supply_voltage_v, step.supply_v, 0.1) << "one circuit";
  }
  EXPECT_GT(given[3].supply_w, 3 * given[0].supply_w);
  const std::string first = test::bytes_of(results_->steps());
  (void)run();
  EXPECT_EQ(test::bytes_of(results_->steps()), first);
}

TEST_F(SupplyCampaign, StepsWithoutASupplyHaveNoSuchColumns) {
  results::StepMean step;
  EXPECT_THAT(results::format_steps({&step, 1}), testing::Not(HasSubstr("supply_w")));
  step.supply_v = step.supply_a = step.supply_w = 2;
  EXPECT_THAT(results::format_steps({&step, 1}), HasSubstr(",quality_flags,supply_v,supply_a,supply_w\n"));
}

TEST_F(SupplyCampaign, StopsWhenTheSupplyLimitsTheCurrentItsProtectionTripsOrSomebodyTurnsTheKnob) {
  expect_stop([&] { circuit().controls().amps = 0.9 * circuit().amps(); }, "current limit reached");
  expect_stop([&] { circuit().trip(SupplyProtection::over_voltage); },
              "over-voltage protection switched the output off");
  expect_stop([&] { circuit().controls().volts = 11.8; }, "changed on the front panel");
}

TEST_F(SupplyCampaign, StopsWhenTheSupplyNoLongerAnswersAndSaysThatItMayBeOn) {
  in_step(0, [&] { spoil(sim::FaultKind::supply_closed, 0); });
  EXPECT_THAT([&] { (void)run(); },
              ThrowsMessage<SafetyStop>(testing::AllOf(testing::StartsWith("supply:"), HasSubstr("it may be ON"))))
      << "nobody missed the supply";
  expect_coast();
}

TEST_F(SupplyCampaign, BearsAnAnswerThatIsLost) {
  in_step(1, [&] { spoil(sim::FaultKind::supply_bad_crc, 2); });
  EXPECT_EQ(run().steps.flagged, 0);
}

TEST_F(SupplyCampaign, CoastsWithinAFifthOfASecondOfTheReading) {
  expect_stop([&] { circuit().trip(SupplyProtection::over_current); }, "over-current");
  const results::RunRecording kept = aborted();
  const auto first = std::find_if(kept.supply.begin(), kept.supply.end(), [](const auto& r) { return r.output == 0; });
  ASSERT_NE(first, kept.supply.end());
  // The motor was let go before the stream ended, and the bridge is open soon after (expect_stop).
  EXPECT_LT(kept.load_cell.back().arrival_ns - first->time_ns, 200'000'000);
}

TEST_F(SupplyCampaign, AnOutputThatComesOnUnaskedAtThePromptIsASafetyStopWhetherOrNotThePromptNotices) {
  for (const bool looks : {true, false}) {
    person_.at_the_stand = [&] {
      circuit().switch_output(true);
      for (int i = 0; i < 60; ++i) {
        bench_->wait_until(bench_->clock().now() + std::chrono::milliseconds(10));
        if (looks) person_.poll();
      }
    };
    EXPECT_THAT([&] { (void)run(); }, ThrowsMessage<SafetyStop>(HasSubstr("output is on while somebody may be near")));
    EXPECT_FALSE(circuit().output());
  }
}

TEST_F(SupplyCampaign, NobodyIsAskedToComeNearBeforeTheRotorIsAtRestWithoutPower) {
  campaign_ = test::short_campaign("0", 1, 2);
  prepare();
  bench_->motor().spin_at(from_rpm(6000));
  bench_->wait_until(bench_->clock().now() + std::chrono::seconds(1));
  bench_->motor().emergency_stop();
  double speed = 1e9;
  person_.at_the_stand = [&] {
    speed = std::abs(bench_->simulation().plant().motor().speed);
    EXPECT_FALSE(circuit().output());
  };
  (void)go(*bench_, *results_);
  EXPECT_LT(speed, 10);
}

}  // namespace supply_campaign_test
}  // namespace kphi::daq
