#include "daq/campaign/campaign_run.hpp"

#include <gmock/gmock.h>

#include "base/error.hpp"
#include "daq/virtual/deterministic_bench.hpp"
#include "results/campaign_folder.hpp"
#include "results/journal.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace campaign_run_test {

using testing::ElementsAre;
using testing::HasSubstr;

class ShortCampaign : public testing::Test {
 protected:
  CampaignResult run(const profiles::Campaign& campaign) {
    return run_campaign(bench_, campaign, config_, results_, person_, progress_, [] { return false; });
  }
  std::vector<std::string> events() {
    std::vector<std::string> names;
    for (const auto& entry : results::read_journal(results_.journal()).entries) names.push_back(entry.event);
    return names;
  }

  test::TemporaryFolder folder_;
  profiles::BenchConfig config_ = test::deterministic_config(2);
  DeterministicBench bench_{config_};
  results::CampaignFolder results_ = results::CampaignFolder::create(folder_.path(), "20210530T000000Z", "short");
  test::ScriptedOperator person_;
  Progress progress_;
};

TEST_F(ShortCampaign, AsksForEachMountingOnceAndRunsAllItsRepetitions) {
  const CampaignResult result = run(test::short_campaign("0, 90", 2, 3));
  EXPECT_THAT(person_.mounted_deg, ElementsAre(0, 90));
  EXPECT_EQ(person_.propeller, "5x3");
  EXPECT_EQ(result.runs, 4);
  EXPECT_EQ(result.steps, 12);
  EXPECT_EQ(result.lost, 0u);
  EXPECT_EQ(results_.complete_runs().size(), 4u);
  EXPECT_THAT(events(), ElementsAre("campaign_started", "clock_unchecked", "mounted", "run_accepted", "run_accepted",
                                    "repetitions_judged", "mounted", "run_accepted", "run_accepted",
                                    "repetitions_judged", "campaign_finished"));
}

TEST_F(ShortCampaign, LeavesAWholeFolderWhoseStepsAreAPureFunctionOfTheRuns) {
  const profiles::Campaign campaign = test::short_campaign("0, 90", 1, 3);
  (void)run(campaign);
  EXPECT_TRUE(results::verify_campaign(results_).whole());
  EXPECT_EQ(test::bytes_of(results_.campaign_file()), campaign.text);
  std::vector<results::StepMean> again;
  for (const auto& file : results_.complete_runs(campaign.occlusions_deg)) {
    for (const auto& step : reduce(results::read_run(file))) again.push_back(step);
  }
  EXPECT_EQ(test::bytes_of(results_.steps()), results::format_steps(again));
}

TEST_F(ShortCampaign, AveragesTheRepetitions) {
  (void)run(test::short_campaign("0", 3, 2));
  const auto steps = results::read_steps(results_.steps());
  const auto means = results::read_steps(results_.means());
  ASSERT_EQ(steps.size(), 6u);
  ASSERT_EQ(means.size(), 2u);
  EXPECT_EQ(means[1].repetition, 0);
  EXPECT_NEAR(means[1].thrust_n, (steps[1].thrust_n + steps[3].thrust_n + steps[5].thrust_n) / 3, 1e-12);
}

TEST_F(ShortCampaign, MeasuresLessThrustUnderAnOcclusion) {
  (void)run(test::short_campaign("0, 270", 1, 3));
  const auto steps = results::read_steps(results_.steps());
  ASSERT_EQ(steps.size(), 6u);
  EXPECT_NEAR(steps[5].thrust_n / steps[2].thrust_n, 0.25, 0.01) << "the paper's quarter";
}

TEST_F(ShortCampaign, KeepsFinishedRunsWhenAMountingIsRefused) {
  person_.refuse_at_deg = 90;
  EXPECT_THROW((void)run(test::short_campaign("0, 90", 1, 3)), NotMounted);
  EXPECT_EQ(results_.complete_runs().size(), 1u);
  EXPECT_EQ(results::read_steps(results_.steps()).size(), 3u);
  EXPECT_THAT(events(),
              ElementsAre("campaign_started", "clock_unchecked", "mounted", "run_accepted", "campaign_stopped"));
}

TEST_F(ShortCampaign, JournalsWhyARunWasStopped) {
  profiles::Campaign campaign = test::short_campaign("0", 1, 3);
  campaign.limits["supply_current_max_a"] = 1.0;
  EXPECT_THROW((void)run(campaign), SafetyStop);
  const auto journal = results::read_journal(results_.journal());
  EXPECT_EQ(journal.entries[3].event, "run_aborted");
  EXPECT_THAT(journal.entries[3].data.at("reason").get<std::string>(),
              AllOf(HasSubstr("supply current"), HasSubstr("coast confirmed after 0.")));
  EXPECT_TRUE(results_.complete_runs().empty());
}

TEST_F(ShortCampaign, JournalsHowLongTheMotorTookToStand) {
  (void)run(test::short_campaign("0", 1, 3));
  const auto stop = results::read_journal(results_.journal()).entries.at(3).data.at("stop");
  EXPECT_EQ(stop.at("confirmed"), true);
  EXPECT_GT(stop.at("time_to_standing_s").get<double>(), stop.at("time_to_coast_s").get<double>());
  EXPECT_LT(stop.at("time_to_coast_s").get<double>(), 0.1) << "a ramp would feed back";
}

TEST_F(ShortCampaign, DoesNotSayThatTheClockIsUncheckedWhenItsGainIsKnown) {
  config_.iq.clock_gain = profiles::ClockGain{1.0, 1e-5, "", ""};
  (void)run(test::short_campaign("0", 1, 3));
  EXPECT_THAT(events(), testing::Not(testing::Contains("clock_unchecked")));
}

TEST_F(ShortCampaign, KeepsWhatTheModuleToldOfItselfInEveryRun) {
  (void)run(test::short_campaign("0, 90", 1, 3));
  for (const auto& file : results_.complete_runs()) {
    EXPECT_THAT(results::read_run(file).header.motor_parameters,
                AllOf(HasSubstr("brushless_drive.volts_limit: "), HasSubstr("uid: \"002300064d4b501120343353\"\n")));
  }
}

TEST(SimulatedMotor, OfAFileTakesTheBuiltInsPlaceAndIsKeptBesideTheBenchFile) {
  const test::TemporaryFolder folder;
  const std::string motor =
      "format: kphi-sim-motor/1\nsupply: {voltage_v: 13.5}\nsensors: {voltage_gain_error_relative: 0}\n";
  std::ofstream(folder.path() / "motor.yaml") << motor;
  std::string text = test::deterministic_config(1).text;
  text.replace(text.find("in_process: true"), 16, "in_process: true, motor: motor.yaml");
  const auto config = profiles::parse_bench(text, (folder.path() / "bench.yaml").string());
  DeterministicBench bench(config);
  EXPECT_NEAR(bench.simulation().plant().motor().supply_volts, 13.5, 0.01);
  const auto results = results::CampaignFolder::create(folder.path(), "u", "c");
  AutoConfirmOperator person;
  Progress progress;
  const auto campaign = test::short_campaign("0", 1, 2);
  (void)run_campaign(bench, campaign, config, results, person, progress, [] { return false; });
  EXPECT_EQ(test::bytes_of(results.motor_file()), motor);
  EXPECT_NE(test::bytes_of(results.journal()).find("motor_sha256"), std::string::npos);
}

TEST(SimulatedMotor, OfABadFileIsRefusedAtItsPlace) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "motor.yaml") << "format: kphi-sim-motor/1\nmotor: {resistance_ohm: low}\n";
  std::string text = test::deterministic_config(1).text;
  text.replace(text.find("in_process: true"), 16, "in_process: true, motor: motor.yaml");
  const auto config = profiles::parse_bench(text, (folder.path() / "bench.yaml").string());
  try {
    const DeterministicBench bench(config);
    FAIL();
  } catch (const ConfigurationError& error) {
    EXPECT_NE(std::string(error.what()).find("motor.yaml:2:25: resistance_ohm: \"low\" is not a number"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(ShortCampaign, RefusesAPropellerThatTheBenchDoesNotHave) {
  profiles::Campaign campaign = test::short_campaign("0", 1, 3);
  campaign.propeller.id = "7x4";
  EXPECT_THROW((void)run(campaign), DeviceError);
}

TEST(Cooling, PausesWithHysteresis) {
  const CoolingRule rule{80, 50};
  EXPECT_FALSE(rule.pauses(false, 79));
  EXPECT_TRUE(rule.pauses(false, 81));
  EXPECT_TRUE(rule.pauses(true, 60)) << "a pause continues where none would begin";
  EXPECT_FALSE(rule.pauses(true, 49));
}

TEST(Cooling, WaitsWhileTheTemperatureIsNotANumber) {
  const CoolingRule rule{80, 50};
  EXPECT_TRUE(rule.pauses(false, std::nan("")));
  EXPECT_TRUE(rule.pauses(true, std::nan("")));
}

TEST(Cooling, NeverPausesWithoutARule) { EXPECT_FALSE(CoolingRule{}.pauses(false, 500)); }

}  // namespace campaign_run_test
}  // namespace kphi::daq
