#include "drivers/iq/link/motor.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <stdexcept>

#include "base/error.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"
#include "test/held_lock.hpp"
#include "test/refusal.hpp"
#include "test/soon.hpp"

namespace kphi::iq {

struct LockOfMotor : kphi::test::HeldLock {
  explicit LockOfMotor(Motor& motor) : HeldLock(motor.mutex_) {}
};

namespace motor_test {

using namespace std::chrono_literals;
using fake::Module;
using fake::ModuleOnALine;
using std::chrono::steady_clock;
using test::soon;

struct Stand {
  SteadyClock clock;
  ModuleOnALine line;
  std::unique_ptr<Motor> motor = std::make_unique<Motor>(line.device(), 115200, Settings{}, clock);

  void spin(double speed) {
    motor->spin_at(RadPerSec(speed));
    ASSERT_TRUE(line.heard_a_speed(speed));
  }
};

std::string refusal(const std::string& device, unsigned baud = 115200) {
  const SteadyClock clock;
  return kphi::refusal([&] { Motor motor(device, baud, Settings{}, clock); });
}

TEST(Motor, ConnectsCoastingAndKnowsItsModule) {
  Stand stand;
  EXPECT_TRUE(stand.line.with([](Module& m) { return m.heard.at(0).is_coast(); }));
  EXPECT_EQ(stand.motor->identity().firmware()->text(), "speed 0.0.32");
  EXPECT_TRUE(stand.motor->alive());
  EXPECT_EQ(stand.motor->failure(), "");
  EXPECT_EQ(stand.line.with([](Module& m) { return fake::to_f32(m.values.at({52, 15})); }), 0.5f);
}

TEST(Motor, SpinsAndBringsTelemetry) {
  Stand stand;
  stand.spin(1234.5);
  std::array<MotorReading, 32> some;
  MotorReading speed;
  ASSERT_TRUE(soon(
      [&] {
        stand.motor->renew();
        const std::size_t n = stand.motor->take(some);
        for (std::size_t i = 0; i < n; ++i) {
          if (some[i].channel == MotorChannel::speed) speed = some[i];
        }
        return speed.value == 1234.5;
      },
      2000ms));
  EXPECT_GT(speed.time_ns, 0);
  EXPECT_LE(Instant(speed.time_ns), stand.clock.now());
  EXPECT_LT(Duration(speed.uncertainty_ns), 50ms);
  EXPECT_GT(stand.motor->counters().replies, 10u);
}

TEST(Motor, ConfirmsThatItCoasts) {
  Stand stand;
  stand.spin(700);
  EXPECT_EQ(stand.motor->stop().outcome, StopReport::Outcome::standing);
  EXPECT_TRUE(stand.line.left_coasting());
  EXPECT_EQ(stand.line.with([](Module& m) { return m.values.at({50, 0}); }), fake::u8(5));
}

TEST(Motor, DoesNotClaimACoastThatTheModuleDenies) {
  Stand stand;
  stand.spin(700);
  stand.line.with([](Module& m) { m.ignore_sets = true; });
  EXPECT_EQ(stand.motor->stop().outcome, StopReport::Outcome::unconfirmed);
}

TEST(Motor, TakesOnlyTheLastOfManyCommandsWhenItCannotKeepUp) {
  Stand stand;
  for (int i = 1; i <= 1000; ++i) stand.motor->spin_at(RadPerSec(i));
  EXPECT_TRUE(stand.line.heard_a_speed(1000));
}

TEST(Motor, CoastsWhileAnotherThreadStandsStillInItsLock) {
  Stand stand;
  stand.spin(700);
  const LockOfMotor held(*stand.motor);
  stand.motor->emergency_stop();
  EXPECT_TRUE(soon([&] { return stand.line.left_coasting(); }, 500ms));
  EXPECT_EQ(stand.motor->failure(), "") << "and the guard waits for nobody";
  EXPECT_TRUE(stand.motor->take_events().empty());
}

TEST(Motor, CoastsByItsLeaseWhileItsCallerStandsStillInItsLock) {
  Stand stand;
  stand.spin(700);
  const LockOfMotor held(*stand.motor);
  EXPECT_TRUE(soon([&] { return stand.line.left_coasting(); }, 2000ms));
  EXPECT_TRUE(stand.motor->lease_has_expired());
}

TEST(Motor, VoidsEachSpeedOfBeforeACoast) {
  Stand stand;
  for (int i = 0; i < 60; ++i) {
    stand.motor->spin_at(RadPerSec(300 + i));
    stand.motor->emergency_stop();
    ASSERT_TRUE(soon([&] { return stand.line.left_coasting(); }, 300ms)) << i << ": before the lease ends it";
  }
  EXPECT_TRUE(stand.motor->stop().safe());
}

TEST(Motor, ReportsAStopThatACoastOverruled) {
  Stand stand;
  for (int i = 0; i < 50; ++i) {  // at rest, and nothing has turned before
    const std::uint64_t ticket = stand.motor->begin_stop({});
    stand.motor->emergency_stop();
    ASSERT_TRUE(soon([&] { return stand.motor->stop_report(ticket).has_value(); }, 5000ms)) << i;
  }
}

TEST(Motor, MayBeAskedAfterItWasClosed) {
  Stand stand;
  stand.spin(700);
  stand.motor->close();
  EXPECT_TRUE(stand.line.left_coasting());
  stand.motor->emergency_stop();
  stand.motor->close();
  EXPECT_NE(stand.motor->failure(), "");
  EXPECT_THROW(stand.motor->spin_at(RadPerSec(100)), DeviceError);
}

TEST(Motor, ObeysManyThreads) {
  Stand stand;
  std::vector<std::future<void>> callers;
  for (int i = 0; i < 4; ++i) {
    callers.push_back(std::async(std::launch::async, [&, i] {
      for (int n = 0; n < 200; ++n) {
        if (i == 0) stand.motor->emergency_stop();
        if (i == 1) stand.motor->renew();
        if (i >= 2) stand.motor->spin_at(RadPerSec(100 * i + n % 7));
        (void)stand.motor->counters();
        (void)stand.motor->identity();
      }
    }));
  }
  for (auto& caller : callers) caller.get();
  EXPECT_TRUE(stand.motor->stop().safe());
  EXPECT_TRUE(stand.line.left_coasting());
}

TEST(Motor, RefusesNonsenseInTheCallersThread) {
  Stand stand;
  EXPECT_THROW(stand.motor->spin_at(RadPerSec(4000)), std::invalid_argument);
  EXPECT_THROW(stand.motor->spin_at(RadPerSec(std::nan(""))), std::invalid_argument);
}

TEST(Motor, RefusesASecondOwner) {
  Stand stand;
  EXPECT_NE(refusal(stand.line.device()).find("in use by another program"), std::string::npos);
  EXPECT_TRUE(stand.motor->alive());
}

TEST(Motor, SaysWithinTwoSecondsThatNoModuleAnswers) {
  ModuleOnALine line([](Module& m) { m.mute = true; });
  const auto start = steady_clock::now();
  const std::string words = refusal(line.device());
  EXPECT_LT(steady_clock::now() - start, 2s);
  EXPECT_NE(words.find("connect at 115200 baud: nothing was received; check its supply"), std::string::npos) << words;
}

TEST(Motor, StretchesProtocolDeadlinesOnAFastBench) {
  const SteadyClock clock(20);
  ModuleOnALine line([&](Module& m) { m = Module([&] { return clock.now(); }); });
  Motor motor(line.device(), 115200, Settings{}, clock);
  EXPECT_EQ(line.with([](Module& m) { return fake::to_f32(m.values.at({52, 15})); }), 0.5f) << "its own seconds";
  std::array<MotorReading, 512> readings;
  std::size_t speeds = 0;
  ASSERT_TRUE(soon(
      [&] {
        const std::size_t n = motor.take(readings);
        for (std::size_t i = 0; i < n; ++i) speeds += readings[i].channel == MotorChannel::speed ? 1 : 0;
        return speeds > 200;
      },
      2000ms));
}

TEST(Motor, AnswersQuestionsInPassing) {
  Stand stand;
  stand.spin(700);
  const auto replies = stand.motor->inquire({{find("brushless_drive.motor_Kv"), {}},
                                             {find("coil_temperature_estimator.otw"), {}},
                                             {find("propeller_motor_control.timeout"), 0.25}});
  ASSERT_EQ(replies.size(), 3u);
  EXPECT_EQ(replies[0].value, 2200.0);
  EXPECT_EQ(replies[1].value, std::nullopt);
  EXPECT_TRUE(replies[2].accepted);
  EXPECT_THROW((void)stand.motor->inquire({{find("propeller_motor_control.ctrl_velocity"), 0.1}}),
               std::invalid_argument);
  EXPECT_TRUE(stand.motor->alive());
}

TEST(Lease, CoastsAMotorWhoseCallerFellSilentWhilePollingGoesOn) {
  Stand stand;
  const auto start = steady_clock::now();
  stand.spin(900);
  ASSERT_TRUE(stand.line.wait_for([](const Module& m) { return m.last_motion()->is_coast(); }, 1000ms));
  EXPECT_GE(steady_clock::now() - start, 490ms);
  EXPECT_TRUE(soon([&] { return stand.motor->counters().lease_expiries == 1; }, 500ms));
  EXPECT_TRUE(stand.motor->alive()) << "it may spin again when told";
  stand.spin(100);
}

TEST(Lease, IsKeptByACallerThatIsAlive) {
  Stand stand;
  stand.spin(900);
  EXPECT_FALSE(soon(
      [&] {
        stand.motor->renew();
        return stand.line.left_coasting();
      },
      900ms));
}

TEST(Lease, IsNotNeededToStayCoasting) {
  Stand stand;
  stand.spin(900);
  ASSERT_TRUE(stand.motor->stop().safe());
  stand.motor->renew();
  EXPECT_FALSE(soon([&] { return !stand.line.left_coasting(); }, 100ms));
}

void until_it_is_dead(Stand& stand) {
  EXPECT_TRUE(soon(
      [&] {
        stand.motor->renew();
        return !stand.motor->alive();
      },
      3000ms));
}

struct WayOut {
  const char* name;
  void (*leave)(Stand&);
};

const WayOut kWaysOut[] = {
    {"Destruction", [](Stand& s) { s.motor.reset(); }},
    {"Exception",
     [](Stand& s) {
       EXPECT_THROW(
           {
             const auto motor = std::move(s.motor);
             throw std::runtime_error("the runner failed");
           },
           std::runtime_error);
     }},
    {"Stop", [](Stand& s) { EXPECT_TRUE(s.motor->stop().safe()); }},
    {"EmergencyStop", [](Stand& s) { s.motor->emergency_stop(); }},
    {"SlowStop", [](Stand& s) { EXPECT_TRUE(s.motor->stop({.deceleration = 1000}).safe()); }},
    {"SlowStopThatIsAbandoned",
     [](Stand& s) {
       auto stop = std::async(std::launch::async, [&] { (void)s.motor->stop({.deceleration = 1000}); });
       s.motor->emergency_stop();
       stop.get();
     }},
    {"ModuleThatRestarts",
     [](Stand& s) {
       s.line.with([](Module& m) { m.restart(); });
       until_it_is_dead(s);
     }},
    {"SpeedZero", [](Stand& s) { s.motor->spin_at(RadPerSec(0)); }},
    {"SilentCaller", [](Stand&) {}},
    {"DestructionWithACommandOnItsWay",
     [](Stand& s) {
       s.motor->spin_at(RadPerSec(1000));
       s.motor.reset();
     }},
    {"DestructionFromAnotherThread", [](Stand& s) { std::async(std::launch::async, [&] { s.motor.reset(); }).get(); }},
    {"ModuleThatStopsAnswering",
     [](Stand& s) {
       s.line.with([](Module& m) { m.mute = true; });
       until_it_is_dead(s);
     }},
    {"ModuleThatDeniesTheCoast",
     [](Stand& s) {
       s.line.with([](Module& m) { m.ignore_sets = true; });
       s.motor.reset();
     }},
    {"ModuleThatSendsGarbage",
     [](Stand& s) {
       s.line.with([](Module& m) {
         m.ignore_sets = true;
         for (auto& [key, value] : m.values) value = fake::Bytes(57, 0x55);
       });
       s.motor.reset();
     }},
};

class EveryWayOut : public testing::TestWithParam<WayOut> {};

TEST_P(EveryWayOut, LeavesCoastAsTheLastMotionCommand) {
  Stand stand;
  stand.spin(2000);
  GetParam().leave(stand);
  EXPECT_TRUE(stand.line.wait_for([](const Module& m) { return m.last_motion()->is_coast(); }, 3000ms));
  stand.motor.reset();
  EXPECT_TRUE(stand.line.left_coasting());
  EXPECT_GE(stand.line.with([](Module& m) { return m.count([](const auto& h) { return h.is_coast(); }); }), 4u);
}

INSTANTIATE_TEST_SUITE_P(Motor, EveryWayOut, testing::ValuesIn(kWaysOut),
                         [](const auto& way) { return std::string(way.param.name); });

TEST(FailedConnection, LeavesCoastAsTheOnlyMotionCommand) {
  void (*const spoils[])(Module&) = {[](Module& m) { m.mute = true; },
                                     [](Module& m) {
                                       m.read_only.insert({52, 15});
                                     },
                                     [](Module& m) {
                                       m.silent.insert({5, 16});
                                     },
                                     [](Module& m) {
                                       m.values[{50, 0}] = fake::u8(3);
                                       m.ignore_sets = true;
                                     }};
  for (const auto& spoil : spoils) {
    ModuleOnALine line(spoil);
    EXPECT_NE(refusal(line.device()), "");
    EXPECT_TRUE(line.left_coasting());
    EXPECT_EQ(line.motions(), 0u);
  }
}

}  // namespace motor_test
}  // namespace kphi::iq
