#include <gtest/gtest.h>

#include <stdexcept>
#include <type_traits>

#include "daq/guard/guard.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace motor_enable_test {

class ToldMotor : public MotorLink {
 public:
  void spin_at(RadPerSec speed) override {
    if (refuse) throw std::runtime_error("refused");
    told.push_back(fmt(speed.value()));
  }
  void renew() noexcept override { told.push_back("renew"); }
  void emergency_stop() noexcept override { told.push_back("emergency stop"); }
  void begin_stop(const iq::StopSettings&) override { told.push_back("stop"); }
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override { return report; }
  [[nodiscard]] const iq::AuditRecord& parameters() const override { return record; }
  [[nodiscard]] std::optional<Celsius> coil_temperature() override { return std::nullopt; }
  [[nodiscard]] std::vector<StreamEvent> take_events() override { return {}; }
  std::size_t take(std::span<MotorReading>) override { return 0; }
  [[nodiscard]] std::string failure() const override { return {}; }
  [[nodiscard]] results::MotorCounts counts() const override { return {}; }
  [[nodiscard]] std::string identity() const override { return {}; }

  std::vector<std::string> told;
  std::optional<iq::StopReport> report;
  iq::AuditRecord record;
  bool refuse = false;

 private:
  static std::string fmt(double v) { return "spin " + std::to_string(static_cast<int>(v)); }
};

/// A guard over a bench that shows nothing.
class Spinning : public testing::Test {
 protected:
  void trip() {
    bench_.queue_motor.lost = "too hot";
    guard_.poll();
  }
  QueueBench bench_;
  profiles::BenchConfig config_ = test::deterministic_config(1);
  Guard guard_{bench_, config_, mini40(), combine_limits(test::short_campaign(), config_)};
};

TEST_F(Spinning, LetsTheMotorGoWhenItGoes) {
  ToldMotor motor;
  { MotorEnable(motor, +1, guard_).at(RadPerSec(100)); }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"spin 100", "emergency stop"}));
}

TEST_F(Spinning, LeavesAMotorAloneThatHasConfirmedItsStop) {
  ToldMotor motor;
  {
    MotorEnable spin(motor, +1, guard_);
    spin.at(RadPerSec(100));
    EXPECT_FALSE(spin.stopped()) << "nobody has asked for a stop";
    spin.begin_stop();
    EXPECT_FALSE(spin.stopped());
    motor.report = iq::StopReport{iq::StopReport::Outcome::standing, 100, 0, {}, {}};
    EXPECT_TRUE(spin.stopped());
  }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"spin 100", "stop"}));
}

TEST_F(Spinning, DoesNotBelieveAStopThatIsUnderWayUnconfirmedOrOverruled) {
  for (const bool reported : {false, true}) {
    ToldMotor motor;
    {
      MotorEnable spin(motor, +1, guard_);
      spin.begin_stop();
      if (reported) motor.report = iq::StopReport{};
      (void)spin.stopped();
    }
    EXPECT_EQ(motor.told.back(), "emergency stop");
  }
  ToldMotor motor;
  {
    MotorEnable spin(motor, +1, guard_);
    spin.begin_stop();
    motor.report = iq::StopReport{iq::StopReport::Outcome::standing, 100, 0, {}, {}};
    (void)spin.stopped();
    spin.at(RadPerSec(100));
  }
  EXPECT_EQ(motor.told.back(), "emergency stop");
}

TEST_F(Spinning, CoastsEvenWhenItNeverSpun) {
  ToldMotor motor;
  { const MotorEnable spin(motor, +1, guard_); }
  EXPECT_EQ(motor.told, (std::vector<std::string>{"emergency stop"}));
}

TEST_F(Spinning, CoastsWhenAnExceptionPasses) {
  ToldMotor motor;
  const auto fail = [&] {
    MotorEnable spin(motor, +1, guard_);
    spin.at(RadPerSec(2000));
    throw std::runtime_error("anything");
  };
  EXPECT_THROW(fail(), std::runtime_error);
  EXPECT_EQ(motor.told.back(), "emergency stop");
}

TEST_F(Spinning, CoastsWhenTheCommandItselfFails) {
  ToldMotor motor;
  motor.refuse = true;
  EXPECT_THROW(MotorEnable(motor, +1, guard_).at(RadPerSec(2000)), std::runtime_error);
  EXPECT_EQ(motor.told.back(), "emergency stop");
}

TEST_F(Spinning, TurnsTheOtherWayForAClockwisePropeller) {
  ToldMotor motor;
  { MotorEnable(motor, -1, guard_).at(RadPerSec(100)); }
  EXPECT_EQ(motor.told.front(), "spin -100");
}

TEST_F(Spinning, TurnsNoMoreAfterATrip) {
  ToldMotor motor;
  trip();
  EXPECT_THROW(MotorEnable(motor, +1, guard_).at(RadPerSec(100)), SafetyStop);
  EXPECT_EQ(motor.told, (std::vector<std::string>{"emergency stop"}));
}

TEST_F(Spinning, CoastsWhenATripComesWhileItSpeaks) {
  class TrippingMotor final : public ToldMotor {
   public:
    void spin_at(RadPerSec speed) override {
      trip();
      ToldMotor::emergency_stop();  // as the guard does, an instant before the command goes out
      ToldMotor::spin_at(speed);
    }
    std::function<void()> trip;
  };
  TrippingMotor motor;
  motor.trip = [this] { trip(); };
  EXPECT_THROW(MotorEnable(motor, +1, guard_).at(RadPerSec(100)), SafetyStop);
  EXPECT_EQ(motor.told, (std::vector<std::string>{"emergency stop", "spin 100", "emergency stop"}));
}

TEST_F(Spinning, GivesNoOrderAfterTheComputerSlept) {
  for (const bool turned_before : {false, true}) {
    ToldMotor motor;
    QueueBench bench;
    Guard guard(bench, config_, mini40(), combine_limits(test::short_campaign(), config_));
    const auto ramp = [&] {
      MotorEnable spin(motor, +1, guard);
      if (turned_before) spin.at(RadPerSec(100));
      bench.time.suspend(std::chrono::milliseconds(200));
      spin.at(RadPerSec(110));
    };
    EXPECT_THROW(ramp(), SafetyStop);
    EXPECT_EQ(motor.told.back(), "emergency stop");
    EXPECT_EQ(std::count(motor.told.begin(), motor.told.end(), "spin 110"), 0);
    EXPECT_EQ(bench.queue_motor.coasted, 1) << "the guard lets go, too";
    EXPECT_EQ(guard.latch().trip()->watched, Watched::sleep);
  }
}

TEST_F(Spinning, GivesNoOrderWhenTheLastOneIsOlderThanTheModuleWaits) {
  ToldMotor motor;
  const auto ramp = [&] {
    MotorEnable spin(motor, +1, guard_);
    spin.at(RadPerSec(100));
    bench_.time.advance(std::chrono::milliseconds(450));
    spin.at(RadPerSec(110));
  };
  EXPECT_THROW(ramp(), SafetyStop);
  EXPECT_EQ(motor.told, (std::vector<std::string>{"spin 100", "emergency stop"}));
}

TEST_F(Spinning, CannotBeCopiedAwayFromItsGuard) {
  EXPECT_FALSE(std::is_copy_constructible_v<MotorEnable>);
  EXPECT_FALSE(std::is_move_constructible_v<MotorEnable>);
}

}  // namespace motor_enable_test
}  // namespace kphi::daq
