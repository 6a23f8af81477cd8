#include "daq/campaign/dry_run.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace dry_run_test {

using testing::HasSubstr;

class FullDisk final : public results::FileLayer {
 public:
  std::uint64_t free_bytes(const std::filesystem::path&) override { return 1000; }
};

class DryRunOfAShortCampaign : public testing::Test {
 protected:
  DryRun dry(std::optional<profiles::Answers> answers = std::nullopt) {
    return dry_run(campaign_, config_, folder_.path() / "not" / "there", answers);
  }
  /// "warning: …" of one subject; empty when it was not looked at.
  static std::string line(const DryRun& dry, const std::string& subject) {
    for (const PlanCheck& check : dry.checks) {
      if (check.subject == subject) return check.finding.line();
    }
    return {};
  }

  test::TemporaryFolder folder_;
  profiles::Campaign campaign_ = test::short_campaign("0, 90", 2);
  profiles::BenchConfig config_ = test::deterministic_config(1);
};

TEST_F(DryRunOfAShortCampaign, FindsNothingToRefuseAndMakesNoFolder) {
  const DryRun found = dry();
  EXPECT_TRUE(found.ok());
  EXPECT_GT(found.bytes_free, found.bytes_needed);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "not"));
  EXPECT_THAT(line(found, "disk"), HasSubstr(folder_.path().string()));
}

TEST_F(DryRunOfAShortCampaign, PrintsMountingsAndRunsInTheirOrder) {
  const std::string text = to_text(dry(), campaign_, config_);
  EXPECT_THAT(text, HasSubstr("  mount no occlusion\n"
                              "     1  5x3_phi000_rep1.h5  4 steps, 6000 to 18000 RPM\n"
                              "     2  5x3_phi000_rep2.h5  4 steps, 6000 to 18000 RPM\n"
                              "  mount 90°\n"
                              "     3  5x3_phi090_rep1.h5  4 steps, 6000 to 18000 RPM\n"));
  EXPECT_THAT(text, HasSubstr("checks: 0 refused, 1 not checked\n  ok           speed  "));
}

TEST_F(DryRunOfAShortCampaign, WarnsOfWhatIsAllowedAndRarelyMeant) {
  EXPECT_EQ(line(dry(), "occlusions"), "");
  campaign_.occlusions_deg = {45, 90};
  EXPECT_THAT(line(dry(), "occlusions"), HasSubstr("warning: no occlusion of 0°: without K_T nothing can be fitted"));
  campaign_.occlusions_deg = {0};
  EXPECT_THAT(line(dry(), "occlusions"), HasSubstr("no occlusion but 0°: K_T is fitted, and no k(φ)"));
  campaign_.occlusions_deg = {0, 0.7854, 1.5708};
  EXPECT_THAT(line(dry(), "occlusions"), HasSubstr("these look like radians"));
}

TEST_F(DryRunOfAShortCampaign, NeedsRoomForWhatEachRunBeginsWith) {
  profiles::Plan plan = profiles::make_plan(campaign_, config_);
  const std::uint64_t few = bytes_needed(plan, config_);
  plan.runs.resize(10 * plan.runs.size(), plan.runs.front());
  EXPECT_GT(bytes_needed(plan, config_), few + 20'000'000) << "of the same samples";
}

TEST_F(DryRunOfAShortCampaign, PrintsTheGuardsOwnLimits) {
  campaign_.limits["torque_max_nm"] = 0.3;
  campaign_.limits["supply_voltage_min_v"] = 10.5;
  const DryRun found = dry();
  const auto guards = combine_limits(campaign_, config_);
  EXPECT_EQ(found.limits, guards);
  const std::string text = to_text(found, campaign_, config_);
  for (const std::string& line : to_lines(guards)) EXPECT_THAT(text, HasSubstr("\n  " + line + "\n"));
  EXPECT_THAT(text, AllOf(HasSubstr("torque about the shaft"), HasSubstr("below 10.5 V"), HasSubstr("speed error")));
  const auto json = to_json(found, campaign_, config_).at("guard_limits");
  ASSERT_EQ(json.size(), guards.size());
  EXPECT_EQ(json[0].at("key"), "thrust_n");
  EXPECT_EQ(json[0].at("limit"), 20);
}

TEST_F(DryRunOfAShortCampaign, PrintsEveryLevelOfShuffledSteps) {
  campaign_.order.steps = profiles::StepOrderKind::shuffled;
  const DryRun found = dry();
  std::string levels;
  for (const auto& step : found.plan.runs[0].steps) levels += fmt::format(" {:.0f}", to_rpm(step.speed));
  EXPECT_THAT(to_text(found, campaign_, config_), HasSubstr("rep1.h5  4 steps, RPM:" + levels + "\n"));
  const auto json = to_json(found, campaign_, config_);
  EXPECT_EQ(json.at("order").at(0).at("steps").at(0).at("step"), found.plan.runs[0].steps[0].number);
  EXPECT_NEAR(json.at("order").at(0).at("steps").at(0).at("speed_rpm").get<double>(),
              to_rpm(found.plan.runs[0].steps[0].speed), 1e-9);
}

TEST_F(DryRunOfAShortCampaign, RefusesMoreSpeedThanTheMotorMayTurnButStillLooksAtTheRest) {
  config_.iq.speed_max = from_rpm(17000);
  const DryRun found = dry();
  EXPECT_FALSE(found.ok());
  EXPECT_THAT(line(found, "speed"), AllOf(HasSubstr("fault: "), HasSubstr("18000 RPM is above 17000 RPM")));
  EXPECT_THAT(line(found, "thrust"), HasSubstr("note: about 4.0 to 4.9 N expected at top speed"));
  EXPECT_EQ(to_json(found, campaign_, config_).at("ok"), false);
  EXPECT_THAT(to_text(found, campaign_, config_),
              AllOf(HasSubstr("checks: 1 refused"), HasSubstr("REFUSED      speed")));
}

TEST_F(DryRunOfAShortCampaign, WarnsOfAThrustLimitThatThePropellerIsLikelyToPass) {
  campaign_.limits["thrust_max_n"] = 4.5;
  EXPECT_THAT(line(dry(), "thrust"), AllOf(HasSubstr("warning: about 4.0 to 4.9 N"), HasSubstr("may stop")));
  EXPECT_TRUE(dry().ok());
  campaign_.limits["thrust_max_n"] = 3;
  EXPECT_THAT(line(dry(), "thrust"), HasSubstr("the limit will stop the run"));
  campaign_.propeller.diameter_in = 9;
  EXPECT_THAT(line(dry(), "thrust"), HasSubstr("no published thrust data"));
  EXPECT_THAT(to_text(dry(), campaign_, config_), HasSubstr("not checked  thrust"));
}

TEST_F(DryRunOfAShortCampaign, RefusesADiskThatIsTooFullAndAFolderThatCannotBeWritten) {
  FullDisk full;
  EXPECT_THAT(line(dry_run(campaign_, config_, folder_.path(), {}, full), "disk"), HasSubstr("fault: "));
  std::ofstream(folder_.path() / "file") << "x";
  EXPECT_THAT(line(dry_run(campaign_, config_, folder_.path() / "file" / "results", {}), "files"),
              HasSubstr("file: no run can be kept here: Not a directory"));
  EXPECT_THAT(line(dry(), "files"), HasSubstr("note: "));
}

TEST_F(DryRunOfAShortCampaign, WarnsOfALineOfTheRotorThatTheRateFoldsDown) {
  config_.netbox.rate_hz = 900;  // three blades at 18000 RPM pass 900 times a second
  EXPECT_THAT(line(dry(), "sampling"), AllOf(HasSubstr("warning: "), HasSubstr("900.0 Hz appears as 0.00 Hz")));
  config_.netbox.rate_hz = 7000;
  EXPECT_THAT(line(dry(), "sampling"), HasSubstr("note: "));
}

TEST_F(DryRunOfAShortCampaign, WarnsOfAStepTooShortToSettle) {
  EXPECT_THAT(line(dry(), "averages"), HasSubstr("warning: 0.3 s of each step"));
  campaign_.profile.dwell = Seconds(2);
  EXPECT_THAT(line(dry(), "averages"), HasSubstr("note: 1.7 s of each step"));
}

TEST_F(DryRunOfAShortCampaign, WarnsOfASupplyThatIsSetBesideTheCampaign) {
  config_.supply = profiles::SupplyConfig{"scpi-tcp:host", Volts(15), Amperes(18), Volts(17), Amperes(20)};
  EXPECT_THAT(line(dry(), "supply"), HasSubstr("warning: set to 15 V"));
  config_.supply->voltage = Volts(12.5);
  EXPECT_THAT(line(dry(), "supply"), HasSubstr("note: set to 12.5 V"));
}

TEST_F(DryRunOfAShortCampaign, WarnsOfStepsDownwardsOnASupplyThatTakesNothingBack) {
  EXPECT_EQ(line(dry(), "braking"), "") << "upwards nothing is given back";
  campaign_.order.steps = profiles::StepOrderKind::up_and_down;
  EXPECT_THAT(line(dry(), "braking"), HasSubstr("note: no ramp: the power supply must absorb"));
  config_.supply = profiles::SupplyConfig{"scpi-tcp:host", Volts(12), Amperes(18), Volts(14), Amperes(20)};
  EXPECT_THAT(line(dry(), "braking"),
              HasSubstr("warning: no ramp: the supply cannot absorb what the rotor feeds back and "
                        "switches off above 14 V; set profile.slew_rpm_s"));
  campaign_.profile.slew_rad_s2 = from_rpm(2000).value();
  EXPECT_EQ(line(dry(), "braking"), "note: the speed falls by 2000 RPM/s at most");
}

TEST_F(DryRunOfAShortCampaign, HoldsAnswersAgainstTheMountings) {
  const auto answers = [](const std::string& list) {
    return profiles::parse_answers("format: kphi-answers/1\nmountings: " + list + "\n", "a.yaml");
  };
  EXPECT_EQ(line(dry(answers("[0, 90]")), "answers"), "note: a.yaml: one answer per mounting");
  EXPECT_THAT(line(dry(answers("[0, 45]")), "answers"), HasSubstr("fault: a.yaml:2:16: mounting 2 is 45°"));
  EXPECT_EQ(line(dry(), "answers"), "");
}

TEST_F(DryRunOfAShortCampaign, SaysThatNobodyKnowsHowLongCoolingTakes) {
  EXPECT_THAT(line(dry(), "coil"), HasSubstr("no pauses"));
  campaign_.limits.cooling = profiles::Cooling{Celsius(70), Celsius(50)};
  EXPECT_THAT(to_text(dry(), campaign_, config_), HasSubstr("pauses for cooling (of unknown length)"));
  campaign_.limits.cooling = profiles::Cooling{Celsius(115), Celsius(50)};
  EXPECT_THAT(line(dry(), "coil"), HasSubstr("warning: "));
}

TEST(ThrustPrior, OfFiveInchesIsWhatOthersMeasuredAndOfSixTwiceThatAndSaysSo) {
  const auto five = profiles::thrust_prior({"5x3", "", 5, 3}), six = profiles::thrust_prior({"6x2", "", 6, 2});
  ASSERT_TRUE(five && six);
  EXPECT_EQ(five->low.value(), 1.12e-6);
  EXPECT_EQ(five->high.value(), 1.38e-6);
  EXPECT_NEAR(thrust_at(five->high, from_rpm(19100)).value(), 5.52, 0.01);
  EXPECT_NEAR(six->low.value(), 2.07 * 1.02e-6, 0.01e-6);
  EXPECT_THAT(six->source, HasSubstr("(D / 5 in)^4"));
}

TEST(ThrustPrior, IsUnknownOfWhatNobodyMeasured) {
  EXPECT_FALSE(profiles::thrust_prior({"5x6", "", 5, 6}));
  EXPECT_FALSE(profiles::thrust_prior({"2x2", "", 2, 2}));
  EXPECT_FALSE(profiles::thrust_prior({"10x2", "", 10, 2}));
}

}  // namespace dry_run_test
}  // namespace kphi::daq
