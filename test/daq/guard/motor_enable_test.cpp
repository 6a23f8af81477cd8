#include <gmock/gmock.h>

#include <stdexcept>
#include <type_traits>

#include "daq/guard/guard.hpp"
#include "test/daq/bench_fixture.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace motor_enable_test {

using testing::ElementsAre;

class ToldMotor : public QueueMotor {
 public:
  void spin_at(RadPerSec speed) override {
    if (trip) {
      trip();
      emergency_stop();  // as the guard does, an instant before the command goes out
    }
    if (refuse) throw std::runtime_error("refused");
    told.push_back("spin " + std::to_string(static_cast<int>(speed.value())));
  }
  void renew() noexcept override { told.push_back("renew"); }
  void emergency_stop() noexcept override { told.push_back("emergency stop"); }
  void begin_stop(const iq::StopSettings&) override { told.push_back("stop"); }
  [[nodiscard]] std::optional<iq::StopReport> stop_report() override { return report; }

  std::vector<std::string> told;
  std::optional<iq::StopReport> report;
  std::function<void()> trip;  ///< while it speaks
  bool refuse = false;
};

const iq::StopReport kStanding{iq::StopReport::Outcome::standing, 100, 0, {}, {}};

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
  ToldMotor motor_;
};

TEST_F(Spinning, LetsTheMotorGoWhenItGoesEvenWhenItNeverSpun) {
  { MotorEnable(motor_, +1, guard_).at(RadPerSec(100)); }
  EXPECT_THAT(motor_.told, ElementsAre("spin 100", "emergency stop"));
  motor_.told.clear();
  { const MotorEnable spin(motor_, +1, guard_); }
  EXPECT_THAT(motor_.told, ElementsAre("emergency stop"));
}

TEST_F(Spinning, RenewsTheLeaseOnlyWhileTheGuardSeesProgress) {
  MotorEnable spin(motor_, +1, guard_);
  spin.renew();
  EXPECT_THAT(motor_.told, ElementsAre("renew"));
  bench_.time.set(std::chrono::milliseconds(410));  // the guard has not looked since
  EXPECT_THROW(spin.renew(), SafetyStop);
  EXPECT_THAT(motor_.told, ElementsAre("renew"));
}

TEST_F(Spinning, RenewsNothingAfterATrip) {
  MotorEnable spin(motor_, +1, guard_);
  trip();
  EXPECT_THROW(spin.renew(), SafetyStop);
  EXPECT_THAT(motor_.told, ElementsAre());
}

TEST_F(Spinning, LeavesAMotorAloneThatHasConfirmedItsStop) {
  {
    MotorEnable spin(motor_, +1, guard_);
    spin.at(RadPerSec(100));
    EXPECT_FALSE(spin.stopped()) << "nobody has asked for a stop";
    spin.begin_stop();
    EXPECT_FALSE(spin.stopped());
    motor_.report = kStanding;
    EXPECT_TRUE(spin.stopped());
  }
  EXPECT_THAT(motor_.told, ElementsAre("spin 100", "stop"));
}

TEST_F(Spinning, DoesNotBelieveAStopThatIsUnderWayUnconfirmedOrOverruled) {
  const std::optional<iq::StopReport> under_way, unconfirmed{iq::StopReport{}}, overruled{kStanding};
  for (const auto& report : {under_way, unconfirmed, overruled}) {
    ToldMotor motor;
    {
      MotorEnable spin(motor, +1, guard_);
      spin.begin_stop();
      motor.report = report;
      const auto stopped = spin.stopped();
      if (stopped && stopped->safe()) spin.at(RadPerSec(100));
    }
    EXPECT_EQ(motor.told.back(), "emergency stop");
  }
}

TEST_F(Spinning, CoastsWhenAnExceptionPassesOrTheCommandItselfFails) {
  const auto fail = [&] {
    MotorEnable spin(motor_, +1, guard_);
    spin.at(RadPerSec(2000));
    throw std::runtime_error("anything");
  };
  for (const bool refuse : {false, true}) {
    motor_.told.clear();
    motor_.refuse = refuse;
    EXPECT_THROW(fail(), std::runtime_error);
    EXPECT_EQ(motor_.told.back(), "emergency stop") << refuse;
  }
}

TEST_F(Spinning, TurnsTheOtherWayForAClockwisePropeller) {
  { MotorEnable(motor_, -1, guard_).at(RadPerSec(100)); }
  EXPECT_EQ(motor_.told.front(), "spin -100");
}

TEST_F(Spinning, TurnsNoMoreAfterATrip) {
  trip();
  EXPECT_THROW(MotorEnable(motor_, +1, guard_).at(RadPerSec(100)), SafetyStop);
  EXPECT_THAT(motor_.told, ElementsAre("emergency stop"));
}

TEST_F(Spinning, CoastsWhenATripComesWhileItSpeaks) {
  motor_.trip = [this] { trip(); };
  EXPECT_THROW(MotorEnable(motor_, +1, guard_).at(RadPerSec(100)), SafetyStop);
  EXPECT_THAT(motor_.told, ElementsAre("emergency stop", "spin 100", "emergency stop"));
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
  const auto ramp = [&] {
    MotorEnable spin(motor_, +1, guard_);
    spin.at(RadPerSec(100));
    bench_.time.advance(std::chrono::milliseconds(450));
    spin.at(RadPerSec(110));
  };
  EXPECT_THROW(ramp(), SafetyStop);
  EXPECT_THAT(motor_.told, ElementsAre("spin 100", "emergency stop"));
}

TEST_F(Spinning, CannotBeCopiedAwayFromItsGuard) {
  EXPECT_FALSE(std::is_copy_constructible_v<MotorEnable>);
  EXPECT_FALSE(std::is_move_constructible_v<MotorEnable>);
}

}  // namespace motor_enable_test
}  // namespace kphi::daq
