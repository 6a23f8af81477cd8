#include "drivers/iq/session/stopping.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace stopping_test {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::Connected;
using fake::State;
using fake::Wire;

struct SpinningWire : Connected {
  explicit SpinningWire(double target = 300, const Settings& settings = {}) : Connected({}, settings) {
    spin(target);
    run_for(100ms);
  }
};

TEST(Coasting, GoesBeforeAllThatHasNotBegunToLeave) {
  Connected wire;
  wire.module.heard.clear();
  Session& session = wire.session;
  session.spin_at(RadPerSec(100), wire.now);
  session.spin_at(RadPerSec(200), wire.now);
  session.sent(5);  // the first speed is under way
  session.coast(wire.now);
  const Bytes first_half{0x55, 0x06, 0x34, 0x05, 0x01};
  wire.module.receive(first_half);
  wire.module.receive(session.output());
  ASSERT_GE(wire.module.heard.size(), 2u);
  EXPECT_TRUE(wire.module.heard[0].is_speed());
  EXPECT_TRUE(wire.module.heard[1].is_coast());
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.is_speed(); }), 1u) << "the second speed is withdrawn";
}

TEST(Coasting, WithdrawsASpeedThatWaitsForCredit) {
  Settings settings;
  settings.credit_bytes = 18;
  Wire wire(settings);
  wire.connect();
  wire.latency = 30ms;
  wire.run_for(60ms);
  const auto speeds = [&] { return wire.module.count([](const auto& m) { return m.is_speed(); }); };
  for (int i = 0; i < 4; ++i) wire.spin(100 + i);
  const auto sent = speeds();
  EXPECT_LT(sent, 4u);
  wire.coast();
  wire.run_for(500ms);
  EXPECT_EQ(speeds(), sent);
  EXPECT_TRUE(wire.module.last_motion()->is_coast());
  EXPECT_TRUE(wire.session.coasting());
}

TEST(Coasting, IsConfirmedOnlyByAQuestionPutAfterwards) {
  Connected wire;
  wire.spin(300);
  wire.latency = 10ms;
  const auto asked_mode = [&] {
    return wire.module.count([](const auto& m) { return m.type == 50 && m.sub == 0 && m.access == 0; });
  };
  wire.module.values[{50, 0}] = fake::u8(5);  // an answer that is already on its way, whatever it means
  const auto before = asked_mode();
  while (asked_mode() == before) wire.run_for(1ms);
  wire.coast();
  EXPECT_EQ(asked_mode(), before + 1) << "the older question is still open";
  wire.run_for(11ms);
  EXPECT_FALSE(wire.session.coasting());
  EXPECT_EQ(asked_mode(), before + 2);
  wire.run_for(10ms);
  EXPECT_TRUE(wire.session.coasting());
}

TEST(Coasting, IsRepeatedUntilConfirmed) {
  SpinningWire wire;
  wire.module.ignore_sets = true;
  wire.coast();
  wire.run_for(25ms);
  EXPECT_FALSE(wire.session.coasting());
  wire.module.ignore_sets = false;
  wire.run_for(25ms);
  EXPECT_TRUE(wire.session.coasting());
  EXPECT_EQ(wire.session.state(), State::ready);
}

/// The longest time in which the module heard nothing.
Duration longest_pause(const Wire& wire) {
  Duration longest{0};
  for (std::size_t i = 1; i < wire.batches.size(); ++i)
    longest = std::max(longest, wire.batches[i].first - wire.batches[i - 1].first);
  return longest;
}

TEST(Coasting, FallsSilentToAMuteModuleAndSendsNoCoastMeanwhile) {
  SpinningWire wire;
  wire.module.mute = true;
  wire.coast();
  ASSERT_TRUE(wire.run_to_state(State::failed, 2s));
  const std::size_t before = wire.batches.size();
  wire.coast();
  EXPECT_EQ(wire.batches.size(), before);
  wire.run_for(3s);
  EXPECT_GT(longest_pause(wire), 500ms);
}

TEST(Coasting, IsConfirmedAgainAfterEachOrder) {
  Connected wire;
  ASSERT_TRUE(wire.session.coasting());
  wire.coast();
  EXPECT_FALSE(wire.session.coasting());
}

TEST(Coasting, FallsSilentWhenUnconfirmedSoThatTheModuleTimesOut) {
  SpinningWire wire;
  wire.module.ignore_sets = true;
  wire.coast();
  wire.run_for(6s);
  EXPECT_EQ(wire.session.state(), State::failed);
  EXPECT_GT(longest_pause(wire), 500ms);
  EXPECT_GT(wire.session.counters().unconfirmed_coasts, 1u) << "and it goes on trying";
  wire.module.ignore_sets = false;
  wire.run_for(3s);
  EXPECT_TRUE(wire.session.coasting());
  EXPECT_EQ(wire.session.state(), State::failed);
}

TEST(Coasting, LeavesAModuleThatRepliesAndDoesNotObeyToItsOwnTimeoutAtOnce) {
  SpinningWire wire;
  wire.module.ignore_sets = true;
  const Instant ordered = wire.now;
  wire.coast();
  wire.run_for(600ms);
  EXPECT_EQ(wire.session.state(), State::failed);
  EXPECT_GE(std::ranges::count_if(wire.batches, [&](const auto& one) { return one.first >= ordered; }), 5);
  EXPECT_LE(wire.batches.back().first, ordered + 100ms) << "what it hears keeps it from timing out";
}

TEST(Coasting, IsWhatAModuleThatStoppedAnsweringHearsLast) {
  SpinningWire wire;
  wire.module.mute = true;
  wire.expect_failure("stopped answering", 3s);
  EXPECT_TRUE(wire.module.last_motion()->is_coast());
  EXPECT_THROW(wire.spin(300), std::logic_error);
}

TEST(Emergency, IsThreeCoastsAtOnceBeforeAllElse) {
  SpinningWire wire(1000);
  wire.batches.clear();
  wire.session.spin_at(RadPerSec(2000), wire.now);
  wire.session.emergency_stop(wire.now);
  wire.flush();
  ASSERT_EQ(wire.batches.size(), 1u);
  const std::string coast = "55 02 34 02 01 8E 06";
  EXPECT_EQ(fake::hex(wire.batches[0].second).substr(0, 3 * 21 - 1), coast + ' ' + coast + ' ' + coast);
  EXPECT_FALSE(wire.module.last_motion()->is_speed());
  wire.run_for(100ms);
  EXPECT_TRUE(wire.session.coasting());
}

TEST(Coasting, ReachesAModuleThatWaitsForTheEndOfAFalseHeader) {
  for (const int length : {6, 30, 59}) {
    Settings settings;
    settings.telemetry_hz = 1;  // no polls that would end the header by their bytes
    SpinningWire wire(1000, settings);
    const Bytes noise{0x55, static_cast<std::uint8_t>(length)};
    (void)wire.module.receive(noise);
    wire.coast();
    wire.run_for(60ms);
    EXPECT_TRUE(wire.module.last_motion()->is_coast()) << length;
    wire.run_for(250ms);
    EXPECT_TRUE(wire.session.coasting()) << length;
  }
}

using Outcome = StopReport::Outcome;

const StopSettings kRamp{.deceleration = 1000};

/// A module whose propeller needs a while to stand still after a coast.
struct Propeller : Wire {
  double speed = 0;  ///< rad/s
  double decay_s;    ///< of the speed while coasting; 0: it never slows down
  Instant last{0};

  explicit Propeller(double target = 0, double decay = 0.4) : decay_s(decay) {
    module.turns_at_once = false;
    before_hearing = [this](Instant at) {
      const bool coasting = module.last_motion() != nullptr && module.last_motion()->is_coast();
      if (coasting && decay_s > 0) speed *= std::exp(-to_seconds(at - last) / decay_s);
      if (!coasting && module.last_motion() != nullptr) speed = fake::to_f32(module.last_motion()->data);
      last = at;
      module.values[{50, 13}] = fake::f32(speed);
    };
    connect();
    if (target != 0) spin(target);
    run_for(200ms);
  }
  void stop(const StopSettings& settings = kRamp) { session.stop(settings, now); }
  std::vector<std::pair<Instant, double>> commands;
  /// Runs until the stop has ended, keeping what was commanded.
  StopReport finish(Duration limit = 20s) {
    const Instant end = now + limit;
    std::size_t seen = module.heard.size();
    while (!session.stop_report() && now < end) {
      run_for(1ms);
      for (; seen < module.heard.size(); ++seen) {
        const auto& heard = module.heard[seen];
        if (heard.is_speed()) commands.emplace_back(now, fake::to_f32(heard.data));
      }
    }
    EXPECT_TRUE(session.stop_report().has_value());
    return session.stop_report().value_or(StopReport{});
  }
};

TEST(Stop, CoastsAtOnceUnlessTheSupplySinksWhatARampFeedsBack) {
  Propeller propeller(2000);
  propeller.stop({});
  const StopReport report = propeller.finish();
  EXPECT_TRUE(propeller.commands.empty());
  EXPECT_EQ(report.outcome, Outcome::standing);
  EXPECT_LT(to_seconds(*report.time_to_coast), 0.05);
}

TEST(Stop, RampsDownNoFasterThanAllowedAndThenCoasts) {
  for (const double sign : {1.0, -1.0}) {
    Propeller propeller(sign * 2000);
    const Instant asked = propeller.now;
    propeller.stop();
    const StopReport report = propeller.finish();
    EXPECT_EQ(report.outcome, Outcome::standing) << report.summary();
    EXPECT_TRUE(report.safe());
    EXPECT_TRUE(propeller.module.last_motion()->is_coast());
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
    EXPECT_GT(propeller.now, asked);
  }
}

TEST(Stop, StartsFromTheSpeedThatIsTurnedWhenTheMotorIsStillOnItsWayUp) {
  Propeller propeller(800);
  propeller.session.spin_at(RadPerSec(3000), propeller.now);
  propeller.stop();
  propeller.flush();
  propeller.finish();
  for (const auto& [time, speed] : propeller.commands) EXPECT_LE(speed, 800);
}

TEST(Stop, AfterAPlainCoastTellsTheTimesToo) {
  Propeller propeller(1000);
  propeller.coast();
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::standing);
  EXPECT_LT(*report.time_to_coast, 50ms);
  EXPECT_NEAR(to_seconds(*report.time_to_standing), 0.4 * std::log(100), 0.1);
  EXPECT_TRUE(propeller.commands.empty());
}

TEST(Stop, SaysThatTheSpeedWasStillFallingAtTheLimit) {
  Propeller propeller(1000, 5);
  propeller.stop({.deceleration = 1000, .limit = 2s});
  EXPECT_EQ(propeller.finish().outcome, Outcome::slowing);
}

TEST(Stop, SaysThatAMotorTurnsOnAlthoughItCoasts) {
  Propeller propeller(1000, 0);
  propeller.stop();
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::turning);
  EXPECT_FALSE(report.time_to_standing.has_value());
  EXPECT_TRUE(report.safe()) << "the module does not drive it";
}

TEST(Stop, SaysThatTheModuleDoesNotConfirm) {
  Propeller propeller(1000);
  propeller.module.ignore_sets = true;
  propeller.coast();
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::unconfirmed);
  EXPECT_FALSE(report.safe());
  EXPECT_EQ(propeller.session.state(), State::failed);
  EXPECT_LT(propeller.now, 2s) << "long before the stop's limit";
}

TEST(Stop, CutShortByACoastCoastsAtOnce) {
  Propeller propeller(3000);
  propeller.stop();
  propeller.run_for(300ms);
  EXPECT_TRUE(propeller.session.spinning());
  propeller.coast();
  EXPECT_TRUE(propeller.module.last_motion()->is_coast());
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::standing);
  EXPECT_NEAR(to_seconds(*report.time_to_coast), 0.3, 0.05);
  EXPECT_TRUE(propeller.commands.empty()) << "no ramp afterwards";
}

TEST(Stop, IsOverruledByANewSpeed) {
  Propeller propeller(3000);
  propeller.stop();
  propeller.run_for(300ms);
  propeller.spin(1500);
  EXPECT_EQ(propeller.session.stop_report()->outcome, Outcome::overruled);
  EXPECT_FALSE(propeller.session.stop_report()->safe());
  propeller.run_for(1s);
  EXPECT_EQ(fake::to_f32(propeller.module.last_motion()->data), 1500);
}

TEST(Stop, OfAModuleThatIsLostEndsInACoastAndSaysSo) {
  Propeller propeller(2000);
  propeller.stop();
  propeller.run_for(100ms);
  propeller.module.mute = true;
  const StopReport report = propeller.finish();
  EXPECT_EQ(report.outcome, Outcome::unconfirmed);
  EXPECT_TRUE(propeller.module.last_motion()->is_coast());
}

TEST(Stop, OfAStandingMotorIsOverAtOnce) {
  Propeller propeller;
  propeller.stop();
  EXPECT_EQ(propeller.finish(1s).outcome, Outcome::standing);
}

TEST(Stop, OfACoastingMotorNeverDrivesIt) {
  Propeller propeller(0, 5);
  propeller.speed = 1500;
  propeller.run_for(200ms);
  propeller.stop();
  propeller.run_for(1s);
  EXPECT_EQ(propeller.module.count([](const auto& m) { return m.is_speed(); }), 0u);
}

struct Seen {
  const char* name;
  std::vector<std::pair<Instant, double>> speeds;
  bool confirmed;
  Outcome outcome;
};

TEST(Stop, IsJudgedByTheConfirmedCoastAndTheSpeedsReadAfterIt) {
  for (const Seen& c : std::vector<Seen>{{"at rest, coast not confirmed", {{2s, 5}}, false, Outcome::unconfirmed},
                                         {"at rest before the coast only", {{900ms, 5}}, true, Outcome::unseen},
                                         {"2 % slower", {{2s, 500}, {3s, 490}}, true, Outcome::turning},
                                         {"10 % slower", {{2s, 500}, {3s, 450}}, true, Outcome::slowing}}) {
    Stopping stopping;
    stopping.begin(kRamp, 1000, true, 0s);
    stopping.coasted(1s);
    for (const auto& [time, speed] : c.speeds) stopping.measured(speed, time);
    if (c.confirmed) stopping.confirmed(4s);
    stopping.advance(5s);
    EXPECT_TRUE(stopping.active()) << c.name;
    stopping.advance(11s);
    ASSERT_TRUE(stopping.report().has_value()) << c.name;
    EXPECT_EQ(stopping.report()->outcome, c.outcome) << c.name;
  }
}

TEST(StopSettings, ThatMakeNoSenseAreRefused) {
  for (const double deceleration : {0.0, 99.0, -1000.0, 1e6, std::nan("")}) {
    EXPECT_THROW(Stopping::check({deceleration, 500, 10, 10s}), std::invalid_argument);
  }
  EXPECT_THROW(Stopping::check({1000, -1, 10, 10s}), std::invalid_argument);
  EXPECT_THROW(Stopping::check({1000, 500, 0, 10s}), std::invalid_argument);
  EXPECT_THROW(Stopping::check({1000, 500, 10, 0s}), std::invalid_argument);
}

}  // namespace stopping_test
}  // namespace kphi::iq
