#include <gtest/gtest.h>

#include <stdexcept>

#include "daq/guard/interlock.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace supply_link_test {

TEST(OutputEnable, HoldsThePowerWhileItLivesAlsoOnTheWayOutOfAnException) {
  QueueSupply supply;
  const auto fail = [&] {
    const OutputEnable powered(supply, test::never);
    EXPECT_TRUE(supply.on);
    throw std::runtime_error("something else");
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_FALSE(supply.on);
}

TEST(OutputEnable, SwitchesOffWhenSwitchingOnFailsHalfway) {
  QueueSupply supply;
  supply.refuses = true;
  EXPECT_THROW((OutputEnable{supply, test::never}), std::runtime_error);
  EXPECT_FALSE(supply.on);
}

/// A motor at a supply that kphi controls.
struct PoweredMotor {
  QueueSupply supply;
  QueueMotor motor;
  ManualClock clock;
};

TEST(MotorPower, GoesOffOnlyOnceTheMotorsLinkIsClosedAndComesBackBeforeTheLink) {
  PoweredMotor bench;
  MotorPower power(&bench.supply, test::never);
  EXPECT_TRUE(bench.supply.on);
  EXPECT_TRUE(power.off(bench.motor));
  EXPECT_EQ(bench.motor.rests, 1);
  EXPECT_FALSE(bench.supply.on);
  power.restore(bench.motor, bench.clock, test::never, [&] {
    EXPECT_TRUE(bench.supply.on);
    EXPECT_EQ(bench.motor.wakes, 0);
  });
  EXPECT_EQ(bench.motor.wakes, 1);
}

TEST(MotorPower, ThatIsNotConfirmedOffIsASafetyStop) {
  PoweredMotor bench;
  MotorPower power(&bench.supply, test::never);
  bench.supply.unconfirmed = kNotOff;
  EXPECT_THROW((void)power.off(bench.motor), SafetyStop);
}

TEST(MotorPower, ComesBackToNoBenchWhoseComputerSlept) {
  PoweredMotor bench;
  MotorPower power(&bench.supply, test::never);
  (void)power.off(bench.motor);
  bench.clock.suspend(std::chrono::milliseconds(200));
  EXPECT_THROW(power.restore(bench.motor, bench.clock, test::never), SafetyStop);
  EXPECT_FALSE(bench.supply.on);
}

TEST(MotorPower, OfAnotherSupplyStaysOnAndOnlyALostModuleIsConnectedAgain) {
  PoweredMotor bench;
  MotorPower power(nullptr, test::never);
  EXPECT_FALSE(power.off(bench.motor));
  EXPECT_EQ(bench.motor.rests, 0);
  power.restore(bench.motor, bench.clock, test::never);
  EXPECT_EQ(bench.motor.wakes, 0);
  bench.motor.lost = "its power was cut";
  power.restore(bench.motor, bench.clock, test::never);
  EXPECT_EQ(bench.motor.wakes, 1);
}

}  // namespace supply_link_test
}  // namespace kphi::daq
