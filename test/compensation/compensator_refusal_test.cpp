// What cannot be built, and what can but deserves a look.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

void expect_refused(const Airframe& airframe, Refusal reason) {
  const ThrustCurve line = paper_line();
  const BuildOutcome outcome = Compensator::build({line, line, line, line}, airframe);
  EXPECT_FALSE(outcome.compensator);
  EXPECT_EQ(outcome.refusal, reason) << describe(outcome.refusal);
}

TEST(CompensatorBuild, IsRefusedForAnAirframeThatCannotBe) {
  for (const double bad : {kNaN, kInfinity, 0.0, -0.1}) {
    Airframe airframe = example_airframe();
    airframe.half_side = Metres(bad);
    expect_refused(airframe, Refusal::sizes);
    airframe = example_airframe();
    airframe.arm_length = Metres(bad);
    expect_refused(airframe, Refusal::sizes);
    airframe = example_airframe();
    airframe.propeller_radius = Metres(bad);
    expect_refused(airframe, Refusal::sizes);
    airframe = example_airframe();
    airframe.fastest_speed = RadPerSec(bad);
    expect_refused(airframe, Refusal::speeds);
  }
  Airframe airframe = example_airframe();
  airframe.arm_length = airframe.propeller_radius;
  expect_refused(airframe, Refusal::arm_length);
  for (const double bad : {kNaN, -1.0, 1e6}) {
    airframe = example_airframe();
    airframe.slowest_speed = RadPerSec(bad);
    expect_refused(airframe, Refusal::speeds);
  }
  for (const int bad : {-1, 0, 2, 4, 33}) {  // arms 0 and 2 are at corners 0 and 2 already
    airframe = example_airframe();
    airframe.hinge_turns[1] = bad;
    expect_refused(airframe, Refusal::hinge_turns);
  }
}

TEST(CompensatorBuild, IsRefusedWhereALineWasFittedWithAnotherMeasure) {
  const ThrustCurve rim = paper_line(), area = paper_line(OverlapMeasure::area_share);
  Airframe airframe = example_airframe();
  EXPECT_EQ(Compensator::build({rim, rim, area, rim}, airframe).refusal, Refusal::overlap);
  airframe.overlap = OverlapMeasure::area_share;
  EXPECT_EQ(Compensator::build({area, area, rim, area}, airframe).refusal, Refusal::overlap);
  EXPECT_TRUE(Compensator::build({area, area, area, area}, airframe).compensator);
}

TEST(CompensatorBuild, DoubtsALineThatStepsAtContactOrGainsWithOcclusion) {
  const auto doubts = [](const ThrustCurve& line, ScalingLaw law) {
    return Compensator::build({line, line, line, line}, example_airframe(), law).doubts[0];
  };
  EXPECT_FALSE(doubts(paper_line(), ScalingLaw::clamped).steps_at_contact);
  EXPECT_TRUE(doubts(paper_line(), ScalingLaw::published).steps_at_contact);
  EXPECT_TRUE(doubts(example_line(0.95, -0.002), ScalingLaw::clamped).steps_at_contact);
  EXPECT_FALSE(doubts(example_line(1.0, -0.002), ScalingLaw::published).steps_at_contact);
  EXPECT_FALSE(doubts(paper_line(), ScalingLaw::clamped).gains_with_occlusion);
  EXPECT_TRUE(doubts(example_line(1.0, 0.001), ScalingLaw::clamped).gains_with_occlusion);
}

}  // namespace
}  // namespace kphi::compensation
