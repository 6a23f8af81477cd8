#include "drivers/iq/session/stopping.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::State;
using fake::Wire;
using Outcome = StopReport::Outcome;

const StopSettings kRamp{.deceleration = 1000};

/// A module whose propeller needs a while to stand still after a coast.
struct Propeller {
  Wire wire;
  double speed = 0;      ///< rad/s
  double decay_s = 0.4;  ///< of the speed while coasting; 0: it never slows down
  Instant last{0};

  Propeller() {
    wire.module.turns_at_once = false;
    wire.before_hearing = [this](Instant now) {
      const bool coasting = wire.module.last_motion() != nullptr && wire.module.last_motion()->is_coast();
      if (coasting && decay_s > 0) speed *= std::exp(-to_seconds(now - last) / decay_s);
      if (!coasting && wire.module.last_motion() != nullptr) speed = fake::to_f32(wire.module.last_motion()->data);
      last = now;
      wire.module.values[{50, 13}] = fake::f32(speed);
    };
    wire.connect();
  }
  void spin(double target) {
    wire.spin(target);
    wire.run_for(200ms);
  }
  std::vector<std::pair<Instant, double>> commands;
  /// Runs until the stop has ended, keeping what was commanded.
  StopReport finish(Duration limit = 20s) {
    const Instant end = wire.now + limit;
    std::size_t seen = wire.module.heard.size();
    while (!wire.session.stop_report() && wire.now < end) {
      wire.run_for(1ms);
      for (; seen < wire.module.heard.size(); ++seen) {
        const auto& heard = wire.module.heard[seen];
        if (heard.is_speed()) commands.emplace_back(wire.now, fake::to_f32(heard.data));
      }
    }
    EXPECT_TRUE(wire.session.stop_report().has_value());
    return wire.session.stop_report().value_or(StopReport{});
  }
};

TEST(Stop, CoastsAtOnceUnlessTheSupplySinksWhatARampFeedsBack) {
  Propeller propeller;
  propeller.spin(2000);
  propeller.wire.session.stop({}, propeller.wire.now);
  const StopReport report = propeller.finish();
  EXPECT_TRUE(propeller.commands.empty());
  EXPECT_EQ(report.outcome, Outcome::standing);
  EXPECT_LT(to_seconds(*report.time_to_coast), 0.05);
}

TEST(Stop, RampsDownNoFasterThanAllowedAndThenCoasts) {
  for (const double sign : {1.0, -1.0}) {
    Propeller propeller;
    propeller.spin(sign * 2000);
    const Instant asked = propeller.wire.now;
    propeller.wire.session.stop(kRamp, propeller.wire.now);
    const StopReport report = propeller.finish();
    EXPECT_EQ(report.outcome, Outcome::standing) << report.summary();
    EXPECT_TRUE(report.safe());
    EXPECT_TRUE(propeller.wire.module.last_motion()->is_coast());
    ASSERT_GT(propeller.commands.size(), 50u) << "in many small steps";
    double before = sign * 2000;
    for (const auto& [time, speed] : propeller.commands) {
      EXPECT_LE(std::abs(speed), std::abs(before));
      EXPECT_LE(std::abs(speed - before), 1000 * 0.0201 + 1e-3);
      EXPECT_GE(std::abs(speed), 500) << "below it coasts; 0 rad/s would brake";
      EXPECT_GE(speed * sign, 0);
      before = speed;
    }
    ASSERT_TRUE(report.time_to_coast.has_value());
    EXPECT_NEAR(to_seconds(*report.time_to_coast), 1.5, 0.1);
    EXPECT_NEAR(to_seconds(*report.time_to_standing), 1.5 + 0.4 * std::log(50), 0.2);
    EXPECT_NEAR(report.speed_at_start, sign * 2000, 1);
    EXPECT_LT(std::abs(report.speed_at_end), 10);
    EXPECT_GT(propeller.wire.now, asked);
  }
}

TEST(Stop, StartsFromTheSpeedThatIsTurnedWhenTheMotorIsStillOnItsWayUp) {
  Propeller propeller;
  propeller.spin(800);
  propeller.wire.session.spin_at(RadPerSec(3000), propeller.wire.now);
  propeller.wire.session.stop(kRamp, propeller.wire.now);
  propeller.wire.flush();
  propeller.finish();
  for (const auto& [time, speed] : propeller.commands) EXPECT_LE(speed, 800);
}

TEST(Stop, AfterAPlainCoastTellsTheTimesToo) {
  Propeller propeller;
  propeller.spin(1000);
  propeller.wire.coast();
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::standing);
  EXPECT_LT(*report.time_to_coast, 50ms);
  EXPECT_NEAR(to_seconds(*report.time_to_standing), 0.4 * std::log(100), 0.1);
  EXPECT_TRUE(propeller.commands.empty());
}

TEST(Stop, SaysThatTheSpeedWasStillFallingAtTheLimit) {
  Propeller propeller;
  propeller.decay_s = 5;
  propeller.spin(1000);
  StopSettings settings;
  settings.limit = 2s;
  settings.deceleration = 1000;
  propeller.wire.session.stop(settings, propeller.wire.now);
  EXPECT_EQ(propeller.finish().outcome, Outcome::slowing);
}

TEST(Stop, SaysThatAMotorTurnsOnAlthoughItCoasts) {
  Propeller propeller;
  propeller.decay_s = 0;
  propeller.spin(1000);
  propeller.wire.session.stop(kRamp, propeller.wire.now);
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::turning);
  EXPECT_FALSE(report.time_to_standing.has_value());
  EXPECT_TRUE(report.safe()) << "the module does not drive it";
}

TEST(Stop, SaysThatTheModuleDoesNotConfirm) {
  Propeller propeller;
  propeller.spin(1000);
  propeller.wire.module.ignore_sets = true;
  propeller.wire.coast();
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::unconfirmed);
  EXPECT_FALSE(report.safe());
  EXPECT_EQ(propeller.wire.session.state(), State::failed);
}

TEST(Stop, CutShortByACoastCoastsAtOnce) {
  Propeller propeller;
  propeller.spin(3000);
  propeller.wire.session.stop(kRamp, propeller.wire.now);
  propeller.wire.run_for(300ms);
  EXPECT_TRUE(propeller.wire.session.spinning());
  propeller.wire.coast();
  EXPECT_TRUE(propeller.wire.module.last_motion()->is_coast());
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::standing);
  EXPECT_NEAR(to_seconds(*report.time_to_coast), 0.3, 0.05);
  EXPECT_TRUE(propeller.commands.empty()) << "no ramp afterwards";
}

TEST(Stop, IsOverruledByANewSpeed) {
  Propeller propeller;
  propeller.spin(3000);
  propeller.wire.session.stop(kRamp, propeller.wire.now);
  propeller.wire.run_for(300ms);
  propeller.wire.spin(1500);
  EXPECT_EQ(propeller.wire.session.stop_report()->outcome, Outcome::overruled);
  EXPECT_FALSE(propeller.wire.session.stop_report()->safe());
  propeller.wire.run_for(1s);
  EXPECT_EQ(fake::to_f32(propeller.wire.module.last_motion()->data), 1500);
}

TEST(Stop, OfAModuleThatIsLostEndsInACoastAndSaysSo) {
  Propeller propeller;
  propeller.spin(2000);
  propeller.wire.session.stop(kRamp, propeller.wire.now);
  propeller.wire.run_for(100ms);
  propeller.wire.module.mute = true;
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::unconfirmed);
  EXPECT_TRUE(propeller.wire.module.last_motion()->is_coast());
}

TEST(Stop, OfAStandingMotorIsOverAtOnce) {
  Propeller propeller;
  propeller.wire.run_for(200ms);
  propeller.wire.session.stop(kRamp, propeller.wire.now);
  EXPECT_EQ(propeller.finish(1s).outcome, Outcome::standing);
}

TEST(StopSettings, ThatMakeNoSenseAreRefused) {
  for (const double deceleration : {0.0, 99.0, -1000.0, 1e6, std::nan("")}) {
    EXPECT_THROW(Stopping::check({deceleration, 500, 10, 10s}), std::invalid_argument);
  }
  EXPECT_THROW(Stopping::check({1000, -1, 10, 10s}), std::invalid_argument);
  EXPECT_THROW(Stopping::check({1000, 500, 0, 10s}), std::invalid_argument);
  EXPECT_THROW(Stopping::check({1000, 500, 10, 0s}), std::invalid_argument);
}

}  // namespace
}  // namespace kphi::iq
