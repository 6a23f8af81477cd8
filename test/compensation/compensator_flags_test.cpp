// What a rotor's command says of itself, and what is done with numbers that are none.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(CompensatorFlags, HoldsTheSpeedLimitsAndSaysSo) {
  Airframe airframe = example_airframe();
  airframe.slowest_speed = from_rpm(1000);
  const ThrustCurve line = paper_line();
  const Compensator compensator = *Compensator::build({line, line, line, line}, airframe).compensator;
  const SpeedCommand command = compensator.speeds_for(thrusts_of(0.0, 100.0, 1.5, kInfinity));
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
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
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
  Compensator compensator = example_compensator();
  auto arms = shape_o();
  arms[3] = Radians(kNaN);
  compensator.set_arms(arms);
  compensator.enable(false);
  compensator.enable(true);
  EXPECT_TRUE(compensator.arm_flags()[3].has(Flag::arm_angle_unknown));
}

TEST(CompensatorFlags, SaysWhenTheOcclusionLiesBeyondTheFit) {
  const ThrustCurve narrow = example_line(1.03, -0.0028889, 60), wide = example_line(1.03, -0.0028889, 65);
  Compensator compensator = *Compensator::build({narrow, wide, narrow, wide}, example_airframe()).compensator;
  compensator.set_arms(shape_o());
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::beyond_fit));
  EXPECT_FALSE(compensator.arm_flags()[1].any());
  EXPECT_FALSE(compensator.arm_flags()[2].any());  // 41°
}

TEST(CompensatorFlags, SaysWhenTheScalingFactorIsAtItsFloor) {
  const ThrustCurve collapsing = example_line(1.0, -0.02);
  Compensator compensator =
      *Compensator::build({collapsing, collapsing, collapsing, collapsing}, example_airframe()).compensator;
  compensator.set_arms(shape_o());
  EXPECT_EQ(compensator.scaling_factors()[0], kScalingFloor);
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::at_floor));
  EXPECT_FALSE(compensator.arm_flags()[2].has(Flag::at_floor));
}

TEST(CompensatorFlags, PublishedLawBeyondZeroSpinsAtTheFastestSpeedNotAtNaN) {
  const ThrustCurve collapsing = example_line(1.0, -0.02);  // k < 0 beyond 50°
  Compensator compensator =
      *Compensator::build({collapsing, collapsing, collapsing, collapsing}, example_airframe(), ScalingLaw::published)
           .compensator;
  compensator.set_arms(shape_o());
  ASSERT_LT(compensator.scaling_factors()[0], 0.0);
  const SpeedCommand command = compensator.speeds_for(thrusts_of(1.0, 0.0, 1.0, 1e-9));
  EXPECT_EQ(command.speeds[0], from_rpm(19100));
  EXPECT_TRUE(command.flags[0].has(Flag::speed_at_fastest));
  EXPECT_EQ(command.speeds[1].value(), 0.0);
  EXPECT_GE(compensator.thrust_max()[0].value(), 0.0);
  EXPECT_EQ(compensator.drag_scale()[0], 1 / kScalingFloor);
}

TEST(CompensatorFlags, SaysWhenTheLineLiesAboveKtAndTheFactorIsHeldAtOne) {
  Compensator clamped = example_compensator(), published = example_compensator(ScalingLaw::published);
  for (Compensator* compensator : {&clamped, &published}) compensator->set_arms(arms_at(148, 45, 180, 45));  // about 4°
  EXPECT_TRUE(clamped.arm_flags()[0].has(Flag::at_ceiling));
  EXPECT_FALSE(clamped.arm_flags()[1].any());
  EXPECT_FALSE(clamped.arm_flags()[2].any());
  EXPECT_FALSE(published.arm_flags()[0].any()) << "equation 4 to the letter holds nothing";
}

TEST(CompensatorFlags, LetsNoNaNOutWhateverGoesIn) {
  std::mt19937_64 random(99);
  const double odd[] = {kNaN, kInfinity, -kInfinity, 1e308, -1e308, 5e-324, 0.0, -0.0, 1.5, 3.0, kPi, -1.2, 100.0};
  std::uniform_int_distribution<std::size_t> pick(0, std::size(odd) - 1);
  const auto four = [&] {
    return std::array<double, 4>{odd[pick(random)], odd[pick(random)], odd[pick(random)], odd[pick(random)]};
  };
  for (const ScalingLaw law : {ScalingLaw::clamped, ScalingLaw::published}) {
    Compensator compensator = example_compensator(law);
    for (int i = 0; i < 50000; ++i) {
      const auto theta = four(), thrust = four();
      compensator.set_arms({Radians(theta[0]), Radians(theta[1]), Radians(theta[2]), Radians(theta[3])});
      const SpeedCommand command = compensator.speeds_for(thrusts_of(thrust[0], thrust[1], thrust[2], thrust[3]));
      for (std::size_t j = 0; j < 4; ++j) {
        ASSERT_GE(command.speeds[j].value(), 0.0);
        ASSERT_LE(command.speeds[j], from_rpm(19100));
        ASSERT_GE(compensator.occlusion_angles()[j].value(), 0.0);
        ASSERT_LE(compensator.occlusion_angles()[j].value(), 2 * kPi);
        ASSERT_GE(compensator.thrust_max()[j].value(), 0.0);
        ASSERT_GE(compensator.drag_scale()[j], 1.0);
        ASSERT_LE(compensator.drag_scale()[j], 1 / kScalingFloor);
      }
    }
  }
}

}  // namespace
}  // namespace kphi::compensation
