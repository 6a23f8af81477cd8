#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>

#include "base/error.hpp"
#include "drivers/iq/link/motor.hpp"
#include "drivers/iq/session/stopping.hpp"
#include "test/drivers/iq/module_on_a_line.hpp"
#include "test/drivers/iq/wire.hpp"
#include "test/soon.hpp"

namespace kphi::iq {
namespace module_watch_test {

using namespace std::chrono_literals;
using fake::Connected;
using fake::Module;
using fake::State;
using fake::Wire;
using testing::HasSubstr;
using testing::IsEmpty;

/// A motor that turns, and what its module hears from then on.
struct Turning {
  Wire wire;
  std::size_t heard_before = 0;
  Turning() {
    wire.connect();
    wire.spin(500);
    wire.run_for(300ms);
    heard_before = wire.module.heard.size();
  }
  [[nodiscard]] std::vector<double> speeds_since() const {
    std::vector<double> speeds;
    for (std::size_t i = heard_before; i < wire.module.heard.size(); ++i)
      if (wire.module.heard[i].is_speed()) speeds.push_back(fake::to_f32(wire.module.heard[i].data));
    return speeds;
  }
  [[nodiscard]] bool noted(EventKind kind) {
    const auto events = wire.session.take_events();
    return std::any_of(events.begin(), events.end(), [&](const StreamEvent& event) { return event.kind == kind; });
  }
  void let_the_module_go() { wire.module.values[{50, 0}] = fake::u8(5); }
};

TEST(DriveWatch, SendsTheNextSpeedOfARampOnceTheModuleDrives) {
  Turning motor;
  for (int i = 1; i <= 20; ++i) {
    motor.wire.session.spin_at(RadPerSec(500 + 10 * i), motor.wire.now);
    motor.wire.run_for(10ms);
  }
  EXPECT_EQ(motor.speeds_since().size(), 20u) << "a question takes 2 ms, the ramp goes on every 10 ms";
  EXPECT_EQ(motor.speeds_since().back(), 700);
}

TEST(DriveWatch, SendsNoSpeedToAModuleThatHasStoppedDriving) {
  Turning motor;
  motor.let_the_module_go();
  motor.wire.spin(600);
  motor.wire.run_for(500ms);
  EXPECT_EQ(motor.wire.session.state(), State::failed);
  EXPECT_TRUE(motor.noted(EventKind::motor_let_go));
  EXPECT_LE(motor.speeds_since().size(), 1u) << "one speed had its confirmation already";
  EXPECT_TRUE(motor.wire.module.last_motion()->is_coast());
  EXPECT_FALSE(motor.wire.session.armed());
}

TEST(DriveWatch, SeesOnASteadySpeedThatTheModuleHasStoppedDriving) {
  Turning motor;
  motor.let_the_module_go();
  motor.wire.run_for(1s);
  EXPECT_TRUE(motor.noted(EventKind::motor_let_go));
  EXPECT_THAT(motor.speeds_since(), IsEmpty());
}

TEST(DriveWatch, OrdersACoastAfterTheHostStoodStillForLongerThanTheModuleWaits) {
  for (const Duration absent : {460ms, 600ms, 5000ms, 60000ms}) {
    Turning motor;
    motor.wire.now += absent;
    motor.wire.spin(600);
    EXPECT_THAT(motor.speeds_since(), IsEmpty()) << to_seconds(absent);
    EXPECT_TRUE(motor.wire.module.last_motion()->is_coast());
    EXPECT_TRUE(motor.noted(EventKind::motor_host_absent));
    EXPECT_THAT(motor.wire.session.failure(), HasSubstr("did not run kphi for"));
  }
}

TEST(DriveWatch, BearsAPauseOfTheHostThatTheModuleBears) {
  Turning motor;
  motor.wire.now += 400ms;
  motor.wire.spin(600);
  motor.wire.run_for(50ms);
  EXPECT_EQ(motor.speeds_since().size(), 1u);
}

TEST(DriveWatch, LetsGoBeforeAModuleThatHearsNothingDoes) {
  Turning motor;
  motor.wire.module.mute = true;
  motor.wire.run_for(470ms);
  EXPECT_EQ(motor.wire.session.state(), State::failed);
  EXPECT_TRUE(motor.wire.module.last_motion()->is_coast());
}

TEST(DriveWatch, AsksNothingMoreOfAMotorThatCoasts) {
  Turning motor;
  motor.wire.coast();
  motor.wire.run_for(100ms);
  motor.wire.now += 5s;
  motor.wire.run_for(300ms);
  EXPECT_EQ(motor.wire.session.state(), State::ready);
}

/// CLOCK_MONOTONIC does not tell that the computer slept.
class SleepingClock final : public Clock {
 public:
  [[nodiscard]] Instant now() const noexcept override { return steady_.now(); }
  [[nodiscard]] Duration stretched(Duration wall) const noexcept override { return wall; }
  [[nodiscard]] Duration shrunk(Duration bench) const noexcept override { return bench; }
  [[nodiscard]] Instant at_realtime(const timespec& stamp) const noexcept override {
    return steady_.at_realtime(stamp);
  }
  [[nodiscard]] std::chrono::system_clock::time_point epoch_utc() const noexcept override {
    return steady_.epoch_utc();
  }
  [[nodiscard]] Duration suspended() const noexcept override { return Duration(suspended_ns.load()); }
  std::atomic<std::int64_t> suspended_ns{0};

 private:
  SteadyClock steady_;
};

TEST(Link, CoastsAfterTheComputerSleptAndTakesNoSpeedAnyMore) {
  SleepingClock clock;
  fake::ModuleOnALine line;
  Motor motor(line.device(), 115200, Settings{}, clock);
  motor.spin_at(RadPerSec(500));
  ASSERT_TRUE(line.heard_a_speed(500));
  clock.suspended_ns = Duration(5s).count();
  ASSERT_TRUE(test::soon([&] { return !motor.alive(); }));
  EXPECT_THROW(motor.spin_at(RadPerSec(600)), DeviceError);
  EXPECT_THAT(motor.failure(), HasSubstr("slept for 5 s"));
  EXPECT_TRUE(line.wait_for([](const Module& m) { return m.last_motion()->is_coast(); }));
  EXPECT_EQ(line.with([](Module& m) { return m.count([](const auto& h) { return h.is_speed(); }); }), 1u);
}

/// Whether its uptime goes backwards or its under-voltage bit is set.
TEST(EveryRestart, IsNoticedNamedAndNeverFollowedByMotion) {
  for (const bool by_uptime : {true, false}) {
    Connected wire;
    wire.spin(1000);
    wire.run_for(600ms);
    EXPECT_EQ(wire.session.state(), State::ready);
    (void)wire.session.take_events();
    const auto speeds = [&] { return wire.module.count([](const auto& m) { return m.is_speed(); }); };
    const auto before = speeds();
    if (by_uptime) {
      wire.module.restart();
    } else {
      wire.module.values[{84, 1}] = fake::u8(1);
    }
    ASSERT_TRUE(wire.run_to_state(State::failed, 300ms)) << by_uptime;
    const auto events = wire.session.take_events();
    ASSERT_EQ(events.size(), 1u);
    EXPECT_EQ(events[0].kind, EventKind::motor_reset);
    EXPECT_TRUE(ends_a_run(events[0].kind));
    EXPECT_EQ(wire.session.counters().module_resets, 1u);
    EXPECT_NE(wire.session.failure().find("restarted by itself"), std::string::npos);
    wire.run_for(100ms);
    EXPECT_TRUE(wire.session.coasting());
    wire.connect();
    wire.run_for(1s);
    EXPECT_EQ(speeds(), before);
    EXPECT_THROW(wire.spin(1000), std::logic_error) << "the owner has not seen it yet";
    EXPECT_EQ(fake::to_f32(wire.module.values.at({52, 15})), 0.5f) << "its settings are there again";
    wire.session.rearm();
    wire.spin(900);
    EXPECT_EQ(speeds(), before + 1);
  }
}

// A loose contact as it is switched on: the uptime of the second start is above that of the first when it is read next.
TEST(Restarts, SoonAfterTheFirstStartAreSeenByTheTimeThatPassed) {
  for (const bool connecting : {true, false}) {
    Wire wire;
    wire.module.restart();
    wire.session.connect(wire.now);
    const auto asked_for_uptime = [&] {
      return wire.module.count([](const auto& m) { return m.type == 5 && m.sub == 15; }) > 0;
    };
    while (connecting ? !asked_for_uptime() : wire.session.state() != State::ready) wire.run_for(1ms);
    wire.run_for(10ms);
    wire.module.mute = true;
    wire.run_for(150ms);
    wire.module.restart();
    wire.module.values[{5, 15}] = fake::f32(0.27);
    wire.module.mute = false;
    ASSERT_TRUE(wire.run_to_state(State::failed, 500ms)) << connecting;
    EXPECT_EQ(wire.session.take_events().back().kind, EventKind::motor_reset) << wire.session.failure();
    EXPECT_THAT(wire.session.failure(), HasSubstr("have passed"));
  }
}

TEST(Restarts, AreNotSeenInOtherFaultsNorInBitsOfBefore) {
  Wire wire;
  wire.module.values[{84, 1}] = fake::u8(0x01);
  wire.connect();
  wire.module.values[{84, 1}] = fake::u8(0x41);
  wire.run_for(2s);
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Restarts, AreNotSeenWhenTheTimeIsSet) {
  Connected wire(1s);
  wire.session.inquire({{find("system_control.time"), 0.0}}, wire.now);
  wire.flush();
  wire.run_for(2s);
  EXPECT_EQ(wire.session.state(), State::ready) << wire.session.failure();
  EXPECT_TRUE(wire.session.inquiries().replies().at(0).accepted);
}

}  // namespace module_watch_test
}  // namespace kphi::iq
