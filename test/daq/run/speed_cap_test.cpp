#include "daq/run/speed_cap.hpp"

#include <gmock/gmock.h>

namespace kphi::daq {
namespace speed_cap_test {

using results::QualityFlag;
using results::StepMean;

using Flags = std::vector<QualityFlag>;

StepMean step(double commanded, double reached, const Flags& flags = {}) {
  StepMean step;
  step.commanded_speed_rad_s = commanded;
  step.speed_rad_s = reached;
  for (const QualityFlag flag : flags) step.quality_flags |= static_cast<std::uint32_t>(flag);
  return step;
}

const Flags kShortOfDrive{QualityFlag::drive_saturated, QualityFlag::speed_not_reached};
const StepMean kHeld = step(1700, 1700);
const StepMean kBarely = step(1800, 1795, {QualityFlag::drive_saturated});
const StepMean kShort = step(1900, 1820, kShortOfDrive);

TEST(SpeedCap, IsTheHighestLevelThatWasReachedWithDriveToSpare) {
  SpeedCap cap;
  const auto lesson = cap.learn(std::vector{step(1600, 1600), kHeld, kBarely, kShort, step(2000, 1820, kShortOfDrive)});
  ASSERT_TRUE(lesson);
  EXPECT_EQ(lesson->commanded, RadPerSec(1900));
  EXPECT_EQ(lesson->reached, RadPerSec(1820));
  EXPECT_EQ(lesson->cap, RadPerSec(1700));
  EXPECT_EQ(cap.speed(), RadPerSec(1700));
  SpeedCap of_any_order;
  EXPECT_TRUE(of_any_order.learn(std::vector{kShort, kHeld, kBarely}));
  EXPECT_EQ(of_any_order.speed(), RadPerSec(1700));
}

TEST(SpeedCap, IsNotLearnedFromASpeedThatWasMissedForAnotherReason) {
  SpeedCap cap;
  EXPECT_FALSE(cap.learn(std::vector{kHeld, step(1900, 1820, {QualityFlag::speed_not_reached})}));
  EXPECT_FALSE(cap.learn(std::vector{kHeld, step(1900, 1999, kShortOfDrive)}));
  EXPECT_FALSE(cap.learn(std::vector{kHeld, kBarely})) << "reached all the same";
  EXPECT_FALSE(cap.learn(std::vector{kShort})) << "no level was held: a cap would leave nothing";
  EXPECT_FALSE(cap.speed());
}

TEST(SpeedCap, IsNotLearnedFromASupplyThatSags) {
  for (const QualityFlag flag : {QualityFlag::supply_sag, QualityFlag::supply_out_of_band}) {
    SpeedCap cap;
    EXPECT_FALSE(cap.learn(
        std::vector{kHeld, step(1900, 1820, {flag, QualityFlag::drive_saturated, QualityFlag::speed_not_reached})}));
  }
}

TEST(SpeedCap, IsLearnedFromADeratedMotorAndALimitedSupply) {
  for (const QualityFlag flag : {QualityFlag::derated, QualityFlag::supply_limited}) {
    SpeedCap cap;
    EXPECT_TRUE(cap.learn(std::vector{kHeld, step(1900, 1820, {flag, QualityFlag::speed_not_reached})}));
  }
}

TEST(SpeedCap, FallsAndNeverRises) {
  SpeedCap cap;
  ASSERT_TRUE(cap.learn(std::vector{step(1600, 1600), kShort}));
  EXPECT_FALSE(cap.learn(std::vector{kHeld, kShort})) << "nothing new";
  EXPECT_EQ(cap.speed(), RadPerSec(1600));
  ASSERT_TRUE(cap.learn(std::vector{step(1500, 1500), step(1600, 1550, kShortOfDrive)}));
  EXPECT_EQ(cap.speed(), RadPerSec(1500));
}

TEST(SpeedCap, TakesTheLevelsAboveOutOfARun) {
  SpeedCap cap;
  std::vector<profiles::PlannedStep> steps{
      {0, RadPerSec(1600)}, {1, RadPerSec(1700)}, {2, RadPerSec(1800)}, {3, RadPerSec(1700)}};
  cap.apply(steps);
  EXPECT_EQ(steps.size(), 4u) << "none is known";
  ASSERT_TRUE(cap.learn(std::vector{kHeld, kShort}));
  cap.apply(steps);
  ASSERT_EQ(steps.size(), 3u);
  EXPECT_EQ(steps[2].number, 3) << "what stays keeps its number";
}

TEST(OutOfDrive, IsAStepThatFallsShortWithNoDriveLeft) {
  EXPECT_TRUE(is_out_of_drive(RadPerSec(1900), RadPerSec(1820), 0.985));
  EXPECT_TRUE(is_out_of_drive(RadPerSec(1900), RadPerSec(1820), -1)) << "clockwise";
  EXPECT_FALSE(is_out_of_drive(RadPerSec(1900), RadPerSec(1820), 0.97)) << "something else holds it back";
  EXPECT_FALSE(is_out_of_drive(RadPerSec(1900), RadPerSec(1885), 1)) << "it was reached, if barely";
  EXPECT_FALSE(is_out_of_drive(RadPerSec(1900), RadPerSec(1990), 1)) << "on its way down";
}

}  // namespace speed_cap_test
}  // namespace kphi::daq
