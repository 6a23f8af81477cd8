// What the compensation says of its inputs: flags of arms, thrusts, speeds and the curve.
#include <gtest/gtest.h>

#include <cmath>

#include "compensation/compensator.hpp"
#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace compensator_flags_test {

ThrustCurve certain_line() { return *paper_line_if(OverlapMeasure::rim_arc, LineUncertainty{1e-8, 1e-18, 0, 0}); }

TEST(CompensatorFlags, DoesNotBelieveAnAngleOutsideTheArmsLimits) {
  Compensator compensator = with_arms(shape_o());
  const double phi = compensator.occlusion_angles()[0].value();
  compensator.set_arms({Radians(45), from_degrees(170), from_degrees(-101), from_degrees(180)});  // 45°, as radians
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::arm_angle_beyond));
  EXPECT_TRUE(compensator.arm_flags()[2].has(Flag::arm_angle_beyond));
  EXPECT_FALSE(compensator.arm_flags()[1].any());
  EXPECT_EQ(compensator.occlusion_angles()[0].value(), phi) << "the last that was believed";
  EXPECT_TRUE(compensator.speeds_for(thrusts_of(1, 1, 1, 1)).flags[0].has(Flag::arm_angle_beyond));
  EXPECT_TRUE(std::isinf(
      compensator.speed_uncertainties(Rotors<ThrustCurve>(4, certain_line()), thrusts_of(1, 1, 1, 1))[0].value()));
  compensator.set_arms(shape_o());
  EXPECT_FALSE(compensator.arm_flags()[0].any());

  Airframe airframe = example_airframe();
  airframe.arms = {from_degrees(0), from_degrees(90), from_degrees(1)};
  Compensator narrow = compensator_of(airframe);
  narrow.set_arms(arms_at(0, 90, 91, -1));
  EXPECT_FALSE(narrow.arm_flags()[1].any());
  EXPECT_TRUE(narrow.arm_flags()[2].has(Flag::arm_angle_beyond) && narrow.arm_flags()[3].has(Flag::arm_angle_beyond));
}

TEST(CompensatorFlags, SaysWhereAnArmHasMovedOnSinceItsAngleWasMeasured) {
  Compensator compensator = example_compensator();
  const auto stale = [&](double age, double rate) {
    compensator.set_arms(shape_o(), {Seconds(age), {RadPerSec(0), RadPerSec(rate), RadPerSec(0), RadPerSec(0)}});
    EXPECT_FALSE(compensator.arm_flags()[0].has(Flag::arm_angle_stale));
    return compensator.arm_flags()[1].has(Flag::arm_angle_stale);
  };
  EXPECT_FALSE(stale(0.010, 3.0)) << "1.7 degrees";
  EXPECT_TRUE(stale(0.020, 3.0)) << "3.4 degrees";
  EXPECT_TRUE(stale(0.020, -3.0));
  EXPECT_FALSE(stale(0.49, 0.0)) << "an arm at rest";
  EXPECT_TRUE(stale(0.01, kNaN));
  for (const double old : {0.51, kNaN, kInfinity}) {
    compensator.set_arms(shape_o(), {Seconds(old), {}});
    for (const Flags flags : compensator.arm_flags()) EXPECT_TRUE(flags.has(Flag::arm_angle_stale)) << old;
  }
  compensator.set_arms(shape_o());
  EXPECT_FALSE(compensator.arm_flags()[1].has(Flag::arm_angle_stale));
}

TEST(CompensatorFlags, HoldsTheSpeedLimitsAndSaysSo) {
  Airframe airframe = example_airframe();
  airframe.slowest_speed = from_rpm(1000);
  const SpeedCommand command = compensator_of(airframe).speeds_for(thrusts_of(0.0, 100.0, 1.5, kInfinity));
  EXPECT_EQ(command.speeds[0], from_rpm(1000));
  EXPECT_TRUE(command.flags[0].has(Flag::speed_at_slowest));
  EXPECT_EQ(command.speeds[1], from_rpm(19100));
  EXPECT_TRUE(command.flags[1].has(Flag::speed_at_fastest));
  EXPECT_FALSE(command.flags[2].any());
  EXPECT_EQ(command.speeds[3], from_rpm(19100));
}

TEST(CompensatorFlags, CountsAThrustThatIsNaNOrNegativeAsZeroAndSaysSo) {
  const SpeedCommand command = example_compensator().speeds_for(thrusts_of(kNaN, -1.0, -kInfinity, 2.0));
  for (const std::size_t i : {0u, 1u, 2u}) EXPECT_EQ(command.speeds[i].value(), 0.0);
  EXPECT_TRUE(command.flags[0].has(Flag::thrust_nan));
  EXPECT_TRUE(command.flags[1].has(Flag::thrust_negative));
  EXPECT_TRUE(command.flags[2].has(Flag::thrust_negative));
  EXPECT_FALSE(command.flags[3].any());
}

TEST(CompensatorFlags, KeepsTheLastOcclusionWhileAnArmAngleIsUnknown) {
  Compensator compensator = with_arms(shape_o());
  const double before = compensator.scaling_factors()[1];
  for (const double unknown : {kNaN, kInfinity, -kInfinity}) {
    auto arms = shape_o();
    arms[1] = Radians(unknown);
    compensator.set_arms(arms);
    EXPECT_EQ(compensator.scaling_factors()[1], before);
    const SpeedCommand command = compensator.speeds_for(thrusts_of(1, 1, 1, 1));
    EXPECT_TRUE(command.flags[1].has(Flag::arm_angle_unknown));
    EXPECT_FALSE(command.flags[0].any());
  }
  compensator.set_arms(shape_o());
  EXPECT_FALSE(compensator.arm_flags()[1].any()) << "the angle that was known before is known again";
}

TEST(CompensatorFlags, EnablingKeepsTheFlagOfAnUnknownArm) {
  Compensator compensator = with_arms(arms_at(180, 180, 180, kNaN));
  compensator.enable(false);
  compensator.enable(true);
  EXPECT_TRUE(compensator.arm_flags()[3].has(Flag::arm_angle_unknown));
}

TEST(CompensatorFlags, SaysWhenTheOcclusionLiesBeyondTheFit) {
  const ThrustCurve narrow = example_line(1.03, -0.0028889, 60), wide = example_line(1.03, -0.0028889, 65);
  const Compensator compensator =
      with_arms(shape_o(), *Compensator::build({narrow, wide, narrow, wide}, example_airframe()).compensator);
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::beyond_fit));
  EXPECT_FALSE(compensator.arm_flags()[1].any());
  EXPECT_FALSE(compensator.arm_flags()[2].any());  // 41°
}

/// In O, with a line that is 0 at 50°.
Compensator collapsing(ScalingLaw law) {
  return with_arms(shape_o(), *build_with(example_line(1.0, -0.02), example_airframe(), law).compensator);
}

TEST(CompensatorFlags, SaysWhenTheScalingFactorIsAtItsFloor) {
  const Compensator compensator = collapsing(ScalingLaw::clamped);
  EXPECT_EQ(compensator.scaling_factors()[0], kScalingFloor);
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::at_floor));
  EXPECT_FALSE(compensator.arm_flags()[2].has(Flag::at_floor));
}

TEST(CompensatorFlags, PublishedLawBeyondZeroSpinsAtTheFastestSpeedNotAtNaN) {
  const Compensator compensator = collapsing(ScalingLaw::published);
  ASSERT_LT(compensator.scaling_factors()[0], 0.0);
  const SpeedCommand command = compensator.speeds_for(thrusts_of(1.0, 0.0, 1.0, 1e-9));
  EXPECT_EQ(command.speeds[0], from_rpm(19100));
  EXPECT_TRUE(command.flags[0].has(Flag::speed_at_fastest));
  EXPECT_EQ(command.speeds[1].value(), 0.0);
  EXPECT_GE(compensator.thrust_max()[0].value(), 0.0);
  EXPECT_EQ(compensator.drag_scale()[0], 1 / kScalingFloor);
}

TEST(CompensatorFlags, SaysWhenTheLineLiesAboveKtAndTheFactorIsHeldAtOne) {
  const auto arms = arms_at(148, 45, 180, 45);  // the first about 4°
  const Compensator clamped = with_arms(arms), published = with_arms(arms, example_compensator(ScalingLaw::published));
  EXPECT_TRUE(clamped.arm_flags()[0].has(Flag::at_ceiling));
  EXPECT_FALSE(clamped.arm_flags()[1].any());
  EXPECT_FALSE(clamped.arm_flags()[2].any());
  EXPECT_FALSE(published.arm_flags()[0].any()) << "equation 4 to the letter holds nothing";
}

}  // namespace compensator_flags_test
}  // namespace kphi::compensation
