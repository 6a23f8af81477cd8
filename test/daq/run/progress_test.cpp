#include "daq/run/progress.hpp"

#include <gmock/gmock.h>

#include "test/daq/bench_fixture.hpp"

namespace kphi::daq {
namespace progress_test {

Position in_a_step() { return {{"5x3"}, 90, 2, 3, 16, 40, "", from_rpm(7895), 372.4}; }

Observation seen() {
  Observation observation;
  observation.speed_rad_s = from_rpm(7893.6).value();
  observation.thrust_n = 1.1621;
  return observation;
}

std::string printed(void (*talk)(Progress&), bool terminal) {
  test::Written written;
  {
    PrintedProgress progress(written.stream, terminal);
    talk(progress);
  }
  return written.text();
}

TEST(Progress, NamesPropellerOcclusionRepetitionStepSpeedsThrustAndTimeLeft) {
  Position position = in_a_step();
  EXPECT_EQ(describe(position, seen()),
            "5x3  φ  90°  rep 2/3  step 17/40  speed  7894 of  7895 RPM  thrust  1.162 N  left 06:12");
  position.repetition = -2;
  EXPECT_EQ(describe(position, seen()).substr(0, 30), "5x3  φ  90°  ref 2  step 17/");
  position.step = -1;
  position.phase = "zero";
  EXPECT_NE(describe(position, seen()).find("zero"), std::string::npos) << "the phase outside steps";
  position.remaining_s = 3725;
  EXPECT_NE(describe(position, seen()).find("left 1:02:05"), std::string::npos) << "hours when there are any";
}

TEST(Progress, BeginsWithTheRunAndTheShareOfTheCampaignThatIsDone) {
  Position position = in_a_step();
  position.run = 7;
  position.runs = 15;
  position.done = 0.4399;
  EXPECT_THAT(describe(position, seen()), testing::StartsWith(" 7/15 43 %  5x3  φ  90°  rep 2/3  step 17/40  "));
  position.done = 0.9999;
  EXPECT_THAT(describe(position, seen()), testing::StartsWith(" 7/15 99 %  ")) << "100 % is the end";
}

TEST(Progress, FitsSixtyColumnsWithThrustAndTimeLeft) {
  Position position = in_a_step();
  position.run = position.runs = 15;
  position.occlusion_deg = 22.5;
  position.commanded = from_rpm(19100);
  position.remaining_s = 36'000;
  position.done = 0.964;
  const std::string narrow = describe(position, seen(), 60);
  EXPECT_EQ(narrow, "15/15 96 % φ 22.5° 17/40 7894/19100 RPM 1.162 N 10:00:00");
  EXPECT_LE(narrow.size(), 60u + 2) << "φ and ° take two bytes";
  position.step = -1;
  position.phase = "spin down";
  EXPECT_EQ(describe(position, seen(), 60), "15/15 96 % φ 22.5° spin down 7894/19100 RPM 1.162 N 10:00:00");
}

TEST(Progress, ShowsNoNumberForWhatNoLongerComes) {
  const std::string begin = "5x3  φ  90°  rep 2/3  step 17/40  speed  ";
  Observation observation = seen();
  observation.load_cell_age = std::chrono::milliseconds(840);
  EXPECT_EQ(describe(in_a_step(), observation),
            begin + "7894 of  7895 RPM  thrust      ? N  left 06:12  no thrust for 0.8 s");
  observation.motor_age = std::chrono::seconds(2);
  EXPECT_EQ(describe(in_a_step(), observation),
            begin + "   ? of  7895 RPM  thrust      ? N  left 06:12  no speed for 2.0 s  no thrust for 0.8 s");
}

TEST(Progress, ShowsNoThrustBeforeItsZero) {
  Observation observation = seen();
  observation.thrust_n = kUnknown;
  EXPECT_THAT(describe(in_a_step(), observation), testing::HasSubstr("thrust      – N  left"));
}

TEST(ProgressByHand, ShowsWhatOneLooksAtWhileTurningAKnob) {
  Observation observation = seen();
  observation.torque_nm = -0.0148;
  observation.judged[Watched::supply_voltage_low] = 12;
  observation.judged[Watched::supply_current] = 2.5;
  observation.vibration.rms = {0.03, 0, 0.04, 0, 0, 0};
  EXPECT_EQ(describe_by_hand(in_a_step(), observation),
            " 7894 of  7895 RPM  thrust  1.162 N  torque  -14.8 mN m    30 W  shakes 0.05 N rms");
  observation.vibration.blade_pass_hz = 394.7;
  observation.vibration.blade_pass_n = 0.0212;
  EXPECT_THAT(describe_by_hand(in_a_step(), observation), testing::EndsWith("rms  blades 0.021 N at 395 Hz"));
  observation.load_cell_age = std::chrono::milliseconds(840);
  EXPECT_THAT(describe_by_hand(in_a_step(), observation),
              testing::AllOf(testing::HasSubstr("thrust      ? N"), testing::EndsWith("no thrust for 0.8 s")));
}

TEST(ProgressElsewhere, IsOneLinePerStepWithoutControlCharacters) {
  const std::string text = printed(
      [](Progress& progress) {
        for (int i = 0; i < 3; ++i) progress.tick(in_a_step(), seen());
        progress.step_done(in_a_step(), seen());
      },
      false);
  EXPECT_EQ(text, describe(in_a_step(), seen()) + "\n");
}

TEST(ProgressOnATerminal, IsRewrittenInPlaceAndClearedBeforeAnythingElse) {
  const std::string text = printed(
      [](Progress& progress) {
        progress.tick(in_a_step(), seen());
        progress.say("run 1 of 15 done");
      },
      true);
  EXPECT_TRUE(text.starts_with("\r5x3"));
  EXPECT_NE(text.find("\r\x1b[Krun 1 of 15 done\n"), std::string::npos);
}

}  // namespace progress_test
}  // namespace kphi::daq
