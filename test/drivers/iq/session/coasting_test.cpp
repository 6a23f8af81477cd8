#include "drivers/iq/session/coasting.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::State;
using fake::Wire;

TEST(Coasting, GoesBeforeAllThatHasNotBegunToLeave) {
  Wire wire;
  wire.connect();
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
  Wire wire;
  wire.connect();
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
  Wire wire;
  wire.connect();
  wire.spin(300);
  wire.run_for(50ms);
  wire.module.ignore_sets = true;
  wire.coast();
  wire.run_for(250ms);
  EXPECT_FALSE(wire.session.coasting());
  wire.module.ignore_sets = false;
  wire.run_for(150ms);
  EXPECT_TRUE(wire.session.coasting());
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Coasting, FallsSilentWhenUnconfirmedSoThatTheModuleTimesOut) {
  Wire wire;
  wire.connect();
  wire.spin(300);
  wire.run_for(50ms);
  wire.module.ignore_sets = true;
  wire.coast();
  wire.run_for(6s);
  EXPECT_EQ(wire.session.state(), State::failed);
  Duration longest{0};
  for (std::size_t i = 1; i < wire.batches.size(); ++i) {
    longest = std::max(longest, wire.batches[i].first - wire.batches[i - 1].first);
  }
  EXPECT_GT(longest, 500ms);
  EXPECT_GT(wire.session.counters().unconfirmed_coasts, 1u) << "and it goes on trying";
  wire.module.ignore_sets = false;
  wire.run_for(3s);
  EXPECT_TRUE(wire.session.coasting());
  EXPECT_EQ(wire.session.state(), State::failed);
}

TEST(Coasting, IsWhatAModuleThatStoppedAnsweringHearsLast) {
  Wire wire;
  wire.connect();
  wire.spin(300);
  wire.run_for(100ms);
  wire.module.mute = true;
  ASSERT_TRUE(wire.run_to_state(State::failed, 3s));
  EXPECT_NE(wire.session.failure().find("stopped answering"), std::string::npos);
  EXPECT_TRUE(wire.module.last_motion()->is_coast());
  EXPECT_THROW(wire.spin(300), std::logic_error);
}

TEST(Emergency, IsThreeCoastsAtOnceBeforeAllElse) {
  Wire wire;
  wire.connect();
  wire.spin(1000);
  wire.run_for(50ms);
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
    Wire wire(settings);
    wire.connect();
    wire.spin(1000);
    wire.run_for(100ms);
    const Bytes noise{0x55, static_cast<std::uint8_t>(length)};
    (void)wire.module.receive(noise);
    wire.coast();
    wire.run_for(60ms);
    EXPECT_TRUE(wire.module.last_motion()->is_coast()) << length;
    wire.run_for(250ms);
    EXPECT_TRUE(wire.session.coasting()) << length;
  }
}

}  // namespace
}  // namespace kphi::iq
