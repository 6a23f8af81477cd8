#include "daq/campaign/campaign_run.hpp"

#include "test/daq/campaign_on_bench.hpp"

namespace kphi::daq {
namespace campaign_run_test {

using testing::ElementsAre;
using testing::HasSubstr;

using ShortCampaign = CampaignOnBench;

TEST_F(ShortCampaign, AsksForEachMountingOnceAndRunsAllItsRepetitions) {
  const CampaignResult result = run(test::short_campaign("0, 90", 2, 3));
  EXPECT_THAT(person_.mounted_deg, ElementsAre(0, 90));
  EXPECT_EQ(person_.propeller, "5x3");
  EXPECT_EQ(result.runs, 4);
  EXPECT_EQ(result.steps.steps, 12);
  EXPECT_EQ(result.lost, 0u);
  EXPECT_EQ(results_->complete_runs().size(), 4u);
  EXPECT_THAT(journaled(), ElementsAre("campaign_started", "clock_unchecked", "mounted", "run_accepted",
                                       "tables_written", "run_accepted", "tables_written", "repetitions_judged",
                                       "mounted", "run_accepted", "tables_written", "run_accepted", "tables_written",
                                       "repetitions_judged", "campaign_finished"));
}

TEST_F(ShortCampaign, TellsWhatIsAskedAndThatItIsAnswered) {
  (void)run(test::short_campaign("0, 90", 1, 3));
  EXPECT_THAT(said_.questions, ElementsAre("Take the occlusion off, then type 0.", "", "Mount 90°, then type 90.", ""));
}

TEST_F(ShortCampaign, LeavesNoQuestionOpenWhenAMountingIsRefused) {
  person_.refuse_at_deg = 90;
  EXPECT_THROW((void)run(test::short_campaign("0, 90", 1, 3)), NotMounted);
  EXPECT_THAT(said_.questions, ElementsAre("Take the occlusion off, then type 0.", "", "Mount 90°, then type 90.", ""));
}

TEST_F(ShortCampaign, LeavesAWholeFolderWhoseStepsAreAPureFunctionOfTheRuns) {
  (void)run(test::short_campaign("0, 90", 1, 3));
  expect_whole();
  EXPECT_EQ(test::bytes_of(results_->campaign_file()), campaign_.text);
}

TEST_F(ShortCampaign, AveragesTheRepetitions) {
  (void)run(test::short_campaign("0", 3, 2));
  ASSERT_EQ(steps().size(), 6u);
  ASSERT_EQ(means().size(), 2u);
  EXPECT_EQ(means()[1].repetition, 0);
  EXPECT_NEAR(means()[1].thrust_n, (steps()[1].thrust_n + steps()[3].thrust_n + steps()[5].thrust_n) / 3, 1e-12);
}

TEST_F(ShortCampaign, MeasuresLessThrustUnderAnOcclusion) {
  (void)run(test::short_campaign("0, 270", 1, 3));
  ASSERT_EQ(steps().size(), 6u);
  EXPECT_NEAR(steps()[5].thrust_n / steps()[2].thrust_n, 0.25, 0.01) << "the paper's quarter";
}

TEST_F(ShortCampaign, KeepsFinishedRunsWhenAMountingIsRefused) {
  person_.refuse_at_deg = 90;
  EXPECT_THROW((void)run(test::short_campaign("0, 90", 1, 3)), NotMounted);
  EXPECT_EQ(results_->complete_runs().size(), 1u);
  EXPECT_EQ(steps().size(), 3u);
  EXPECT_THAT(journaled(), ElementsAre("campaign_started", "clock_unchecked", "mounted", "run_accepted",
                                       "tables_written", "campaign_stopped"));
}

TEST_F(ShortCampaign, JournalsWhyARunWasStopped) {
  campaign_ = test::short_campaign("0", 1, 3);
  campaign_.limits["supply_current_max_a"] = 1.0;
  EXPECT_THROW((void)run(), SafetyStop);
  EXPECT_EQ(journal()[3].event, "run_aborted");
  EXPECT_THAT(journal()[3].data.at("reason").get<std::string>(),
              AllOf(HasSubstr("supply current"), HasSubstr("coast confirmed after 0.")));
  EXPECT_TRUE(results_->complete_runs().empty());
}

TEST_F(ShortCampaign, JournalsHowLongTheMotorTookToStand) {
  (void)run(test::short_campaign("0", 1, 3));
  const auto stop = journal().at(3).data.at("stop");
  EXPECT_EQ(stop.at("confirmed"), true);
  EXPECT_GT(stop.at("time_to_standing_s").get<double>(), stop.at("time_to_coast_s").get<double>());
  EXPECT_LT(stop.at("time_to_coast_s").get<double>(), 0.1) << "a ramp would feed back";
}

TEST_F(ShortCampaign, DoesNotSayThatTheClockIsUncheckedWhenItsGainIsKnown) {
  config_.iq.clock_gain = profiles::ClockGain{1.0, 1e-5, "", ""};
  (void)run(test::short_campaign("0", 1, 3));
  EXPECT_THAT(journaled(), testing::Not(testing::Contains("clock_unchecked")));
}

TEST_F(ShortCampaign, KeepsWhatTheModuleToldOfItselfInEveryRun) {
  (void)run(test::short_campaign("0, 90", 1, 3));
  for (const auto& file : results_->complete_runs()) {
    EXPECT_THAT(results::read_run(file).header.motor_parameters,
                AllOf(HasSubstr("brushless_drive.volts_limit: "), HasSubstr("uid: \"002300064d4b501120343353\"\n")));
  }
}

TEST_F(ShortCampaign, TakesASimulatedMotorOfAFileInTheBuiltInsPlaceAndKeepsItBesideTheBenchFile) {
  const std::string motor =
      "format: kphi-sim-motor/1\nsupply: {voltage_v: 13.5}\nsensors: {voltage_gain_error_relative: 0}\n";
  use_motor(motor);
  prepare();
  EXPECT_NEAR(bench_->simulation().plant().motor().supply_volts, 13.5, 0.01);
  campaign_ = test::short_campaign("0", 1, 2);
  (void)go(*bench_, *results_);
  EXPECT_EQ(test::bytes_of(results_->motor_file()), motor);
  EXPECT_NE(test::bytes_of(results_->journal()).find("motor_sha256"), std::string::npos);
}

TEST_F(ShortCampaign, RefusesABadFileOfASimulatedMotorAtItsPlace) {
  use_motor("format: kphi-sim-motor/1\nmotor: {resistance_ohm: low}\n");
  EXPECT_THAT([&] { prepare(); }, testing::ThrowsMessage<ConfigurationError>(
                                      HasSubstr("motor.yaml:2:25: resistance_ohm: \"low\" is not a number")));
}

TEST_F(ShortCampaign, RefusesAPropellerThatTheBenchDoesNotHave) {
  campaign_.propeller.id = "7x4";
  EXPECT_THROW((void)run(), DeviceError);
}

TEST(Cooling, PausesWithHysteresisAndWhileTheTemperatureIsNotANumberButNeverWithoutARule) {
  const CoolingRule rule{80, 50};
  EXPECT_FALSE(rule.pauses(false, 79));
  EXPECT_TRUE(rule.pauses(false, 81));
  EXPECT_TRUE(rule.pauses(true, 60)) << "a pause continues where none would begin";
  EXPECT_FALSE(rule.pauses(true, 49));
  for (const bool paused : {false, true}) EXPECT_TRUE(rule.pauses(paused, std::nan("")));
  EXPECT_FALSE(CoolingRule{}.pauses(false, 500));
}

}  // namespace campaign_run_test
}  // namespace kphi::daq
