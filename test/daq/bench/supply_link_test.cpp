#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <stdexcept>

#include "daq/guard/interlock.hpp"
#include "test/daq/bench_fixture.hpp"
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

/// What leaves `work`, if the supply does not confirm that it is off again.
template <class Thrown>
std::optional<Thrown> thrown_by(const std::function<void()>& work) {
  try {
    work();
  } catch (const Thrown& thrown) {
    return thrown;
  }
  return std::nullopt;
}

TEST(MotorPower, ThatIsNotConfirmedOffAfterAnInterruptionIsToldOf) {
  PoweredMotor bench;
  bench.supply.unconfirmed = kNotOff;
  bench.supply.interrupted = true;
  const auto stop = thrown_by<Interrupted>([&] { const MotorPower power(&bench.supply, test::never); });
  ASSERT_TRUE(stop.has_value());
  EXPECT_EQ(stop->words().state, kNotOff);
  EXPECT_EQ(stop->exit_code(), ExitCode::interrupted);
  bench.supply.unconfirmed.clear();
  EXPECT_EQ(thrown_by<Interrupted>([&] { const MotorPower power(&bench.supply, test::never); })->words().state, "");
}

TEST(MotorPower, ThatIsNotConfirmedOffAfterAFailureIsToldOfWithTheFailuresExitCode) {
  PoweredMotor bench;
  bench.supply.unconfirmed = kNotOff;
  const auto fail = [&] {
    try {
      throw DeviceError("motor", "connect", "no answer");
    } catch (...) {
      rethrow_without_power(&bench.supply);
    }
  };
  const auto stop = thrown_by<RunStopped>(fail);
  ASSERT_TRUE(stop.has_value());
  EXPECT_EQ(stop->words().cause, "motor: connect: no answer");
  EXPECT_EQ(stop->words().state, kNotOff);
  EXPECT_EQ(stop->exit_code(), ExitCode::no_device);
  bench.supply.unconfirmed.clear();
  EXPECT_TRUE(thrown_by<DeviceError>(fail).has_value()) << "as it was";
}

TEST(MotorPower, IsCutHoweverTheWorkAtTheBenchEndsAndIsToldOfOnce) {
  QueueSupply supply;
  QueueBench bench;
  bench.supply_link = &supply;
  supply.unconfirmed = kNotOff;
  const auto state_after = [&](const StopWords& words) {
    return thrown_by<Interrupted>([&] { leave_without_power(bench, [&] { throw Interrupted(words); }); })
        ->words()
        .state;
  };
  EXPECT_EQ(state_after({.cause = "stopped by request"}), kNotOff);
  EXPECT_EQ(state_after({.cause = "stopped by request", .state = "supply: output off"}), "supply: output off");
}

TEST(MotorPower, ThatIsConfirmedOffLeavesTheEndOfTheWorkAsItWas) {
  struct MoreThanAnInterruption : Interrupted {
    using Interrupted::Interrupted;
  };
  QueueSupply supply;
  QueueBench bench;
  bench.supply_link = &supply;
  const auto leave = [&] { leave_without_power(bench, [] { throw MoreThanAnInterruption("nobody was there"); }); };
  EXPECT_TRUE(thrown_by<MoreThanAnInterruption>(leave).has_value());
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
