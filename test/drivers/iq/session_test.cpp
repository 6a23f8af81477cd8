#include "drivers/iq/session.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::State;
using fake::Wire;

constexpr Duration kTimeout = 100ms;

bool is_reply(const Bytes& reply, int type, int sub) { return reply.size() > 4 && reply[2] == type && reply[3] == sub; }

TEST(Connecting, CoastsBeforeAnythingElse) {
  Wire wire;
  wire.connect();
  ASSERT_FALSE(wire.module.heard.empty());
  EXPECT_TRUE(wire.module.heard[0].is_coast());
  EXPECT_EQ(fake::hex(std::span(wire.batches[0].second).first(7)), "55 02 34 02 01 8E 06");
}

TEST(Connecting, ReadsWhoTheModuleIs) {
  Wire wire;
  wire.connect();
  const Identity& identity = wire.session.identity();
  EXPECT_EQ(identity.firmware_text(), "speed 0.0.32");
  EXPECT_EQ(identity.uid_text(), "111111112222222233333333");
  EXPECT_EQ(identity.hardware, 0x10100u);
  EXPECT_EQ(identity.electronics, 0x30000u);
  EXPECT_EQ(identity.pole_pairs, 7);
  EXPECT_EQ(identity.motor_kv_rpm_per_volt, 2200);
  EXPECT_EQ(identity.timeout_s, 0.5);
  EXPECT_EQ(identity.coil_temperature_client, 83);
  EXPECT_NE(identity.summary().find("speed 0.0.32"), std::string::npos);
}

TEST(Connecting, MakesTheModuleCoastByItselfWithoutASong) {
  Wire wire;
  wire.connect();
  EXPECT_EQ(fake::to_f32(wire.module.values.at({52, 15})), 0.5f);
  EXPECT_EQ(wire.module.values.at({52, 18}), fake::u8(0));
  EXPECT_EQ(wire.module.values.at({52, 19}), fake::u8(0));
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.access == 2; }), 0u) << "nothing is ever saved";
}

TEST(Connecting, FailsWhenTheTimeoutIsNotAccepted) {
  for (const int sub : {15, 18, 19}) {
    Wire wire;
    wire.module.read_only = {{52, sub}};
    wire.session.connect(wire.now);
    ASSERT_TRUE(wire.run_to_state(State::failed, 3s)) << sub;
    EXPECT_NE(wire.session.failure().find("it would keep spinning if this host died"), std::string::npos)
        << wire.session.failure();
    EXPECT_TRUE(wire.module.last_motion()->is_coast());
  }
}

TEST(Connecting, ComparesTheTimeoutBitByBit) {
  Wire wire;
  wire.module.read_only = {{52, 15}};
  wire.module.values[{52, 15}] = fake::f32(std::nextafter(0.5f, 1.0f));
  wire.session.connect(wire.now);
  EXPECT_TRUE(wire.run_to_state(State::failed, 3s));
}

TEST(Connecting, RepeatsASetThatWasLost) {
  Wire wire;
  wire.module.ignore_sets = true;
  wire.session.connect(wire.now);
  const auto sets = [&] {
    return wire.module.count([](const auto& m) { return m.type == 52 && m.sub == 15 && m.access == 1; });
  };
  while (sets() == 0) wire.run_for(1ms);
  wire.module.ignore_sets = false;
  EXPECT_TRUE(wire.run_to_state(State::ready, 1s)) << wire.session.failure();
  EXPECT_GE(sets(), 2u);
}

TEST(Connecting, AcceptsOldFirmwareWithoutTimeoutBehaviour) {
  Wire wire;
  wire.module.silent = {{77, 0}, {52, 18}, {52, 19}};
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::ready, 10s)) << wire.session.failure();
  EXPECT_FALSE(wire.session.identity().timeout_behavior_set);
}

TEST(Connecting, TakesTheCoilTemperatureOfOldFirmware) {
  Wire wire;
  wire.module.silent = {{83, 0}};
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::ready, 3s)) << wire.session.failure();
  EXPECT_EQ(wire.session.identity().coil_temperature_client, 77);
  wire.readings();
  wire.run_for(1s);
  const auto temperatures = wire.values(Quantity::coil_temperature);
  ASSERT_FALSE(temperatures.empty());
  EXPECT_EQ(temperatures[0], 44.5);
}

TEST(Connecting, GoesOnWithoutACoilTemperature) {
  Wire wire;
  wire.module.silent = {{83, 0}, {77, 0}};
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::ready, 3s)) << wire.session.failure();
  wire.run_for(1s);
  EXPECT_TRUE(wire.values(Quantity::coil_temperature).empty());
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Connecting, FailsWithinASecondWhenNothingAnswers) {
  Wire wire;
  wire.module.mute = true;
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::failed, 1s));
  EXPECT_EQ(wire.session.failure(), "nothing was received");
}

TEST(Connecting, SaysWhenOnlyGarbageComes) {
  Wire wire;
  wire.spoil = [](Bytes& reply, Duration&) { reply = {0x00, 0xE6, 0x55, 0x80}; };
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::failed, 1s));
  EXPECT_EQ(wire.session.failure(), "bytes were received, but no valid packet");
}

TEST(Connecting, SaysWhenAnotherModuleAnswers) {
  Wire wire;
  wire.spoil = [](Bytes& reply, Duration&) { reply = fake::message(50, 0, 3, 5, fake::u8(5)); };
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::failed, 1s));
  EXPECT_EQ(wire.session.failure(), "only modules with another id answer");
  EXPECT_GT(wire.session.counters().wrong_module, 0u);
}

TEST(Connecting, FailsWhenTheModuleDoesNotCoast) {
  Wire wire;
  wire.module.ignore_sets = true;
  wire.module.values[{50, 0}] = fake::u8(3);
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::failed, 2s));
  EXPECT_NE(wire.session.failure().find("does not confirm that it coasts"), std::string::npos);
}

TEST(Settings, ThatMakeNoSenseAreRefused) {
  for (const auto& spoil : std::vector<std::function<void(Settings&)>>{
           [](Settings& s) { s.module_id = 63; }, [](Settings& s) { s.module_id = -1; },
           [](Settings& s) { s.telemetry_hz = 0; }, [](Settings& s) { s.telemetry_hz = std::nan(""); },
           [](Settings& s) { s.module_timeout_s = 0; }, [](Settings& s) { s.credit_bytes = 17; }}) {
    Settings settings;
    spoil(settings);
    EXPECT_THROW(Session{settings}, std::invalid_argument);
  }
}

TEST(Spinning, IsRefusedUnlessReady) {
  Wire wire;
  EXPECT_THROW(wire.spin(100), std::logic_error);
  wire.session.connect(wire.now);
  EXPECT_THROW(wire.spin(100), std::logic_error);
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.is_speed(); }), 0u);
}

TEST(Spinning, IsRefusedBeyondTheRangeAndForNonsense) {
  Wire wire;
  wire.connect();
  for (const double speed : {3450.1, -3451.0, std::nan(""), std::numeric_limits<double>::infinity()}) {
    EXPECT_THROW(wire.spin(speed), std::invalid_argument);
  }
  EXPECT_FALSE(wire.session.spinning());
}

TEST(Spinning, SendsTheSpeedWithItsSign) {
  Wire wire;
  wire.connect();
  wire.batches.clear();
  wire.spin(-12.5);
  ASSERT_EQ(wire.batches.size(), 1u);
  EXPECT_EQ(fake::hex(wire.batches[0].second), "55 06 34 05 01 00 00 48 C1 E6 8D");
  EXPECT_TRUE(wire.session.spinning());
  EXPECT_FALSE(wire.session.coasting());
}

TEST(Spinning, AtZeroIsACoast) {
  Wire wire;
  wire.connect();
  wire.spin(500);
  wire.spin(0);
  EXPECT_FALSE(wire.session.spinning());
  EXPECT_TRUE(wire.module.last_motion()->is_coast());
}

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

TEST(Telemetry, ReadsSpeedEveryCycleAndTheOthersInTurn) {
  Wire wire;
  wire.connect();
  wire.spin(1000);
  wire.run_for(200ms);
  wire.readings();
  wire.run_for(3s);
  std::map<Quantity, int> count;
  std::map<Quantity, double> value;
  for (const Reading& reading : wire.readings()) {
    ++count[reading.quantity];
    value[reading.quantity] = reading.value;
  }
  EXPECT_NEAR(count[Quantity::speed], 150, 1);
  for (int i = 1; i < kQuantities; ++i) EXPECT_NEAR(count[static_cast<Quantity>(i)], 150.0 / (kQuantities - 1), 1) << i;
  EXPECT_EQ(value[Quantity::speed], 1000);
  EXPECT_EQ(value[Quantity::supply_voltage], 12.5);
  EXPECT_EQ(value[Quantity::supply_current], 3.25);
  EXPECT_EQ(value[Quantity::motor_current], 10);
  EXPECT_EQ(value[Quantity::coil_temperature], 55.25);
  EXPECT_EQ(value[Quantity::derate], 1.0);
  EXPECT_EQ(value[Quantity::drive_mode], 3);
}

TEST(Telemetry, AsksBothOfACycleInOneBatch) {
  Wire wire;
  wire.connect();
  wire.run_for(100ms);
  wire.batches.clear();
  wire.run_for(1s);
  const auto both = [](const auto& batch) { return batch.second.size() >= 14; };
  EXPECT_EQ(std::count_if(wire.batches.begin(), wire.batches.end(), both), 50 + 2)
      << "twice it looks for a restart alone";
  EXPECT_EQ(wire.batches.size(), 50u + 2u);
}

TEST(Telemetry, IsNotDoubledWhenTheModuleIsSlow) {
  Wire wire;
  wire.connect();
  wire.latency = 55ms;
  wire.run_for(100ms);
  wire.module.heard.clear();
  wire.run_for(1s);
  const auto speeds = wire.module.count([](const auto& m) { return m.type == 50 && m.sub == 13; });
  EXPECT_LE(speeds, 1000u / 55 + 1);
  EXPECT_GE(speeds, 15u);
  EXPECT_GT(wire.session.counters().skipped_polls, 0u);
}

TEST(Telemetry, StaysInsideTheCreditWindow) {
  for (const std::size_t credit : {18u, 21u, 63u}) {
    Settings settings;
    settings.credit_bytes = credit;
    settings.telemetry_hz = 1000;
    settings.slow_hz = 1000;
    Wire wire(settings);
    wire.latency = 9ms;
    std::size_t most = 0;
    wire.spoil = [&](Bytes&, Duration&) { most = std::max(most, 7 * (wire.replies_on_their_way() + 1)); };
    wire.session.connect(wire.now);
    for (int i = 0; i < 3000; ++i) {
      wire.run_for(100us);
      if (wire.session.state() == State::ready && i % 50 == 0) wire.spin(100 + i);
    }
    EXPECT_LE(most, credit);
    EXPECT_GE(most, std::min<std::size_t>(credit, 42) / 7 * 7) << "pipelined";
  }
}

TEST(Telemetry, StampsTheMiddleLessTheTimeOnTheWire) {
  Settings settings;
  settings.wire_byte_time = 100us;
  Wire wire(settings);
  wire.latency = 7 * 100us + 11 * 100us + 2ms;
  wire.connect();
  wire.run_for(1s);
  wire.readings();
  wire.batches.clear();
  wire.run_for(20ms);
  ASSERT_EQ(wire.batches.size(), 1u);
  wire.run_for(10ms);
  const auto readings = wire.readings();
  EXPECT_TRUE(std::any_of(readings.begin(), readings.end(), [&](const Reading& reading) {
    return reading.quantity == Quantity::speed && reading.time == wire.batches[0].first + 700us + 1ms &&
           reading.uncertainty == 1ms;
  }));
}

TEST(Telemetry, UncertaintyCoversTheMomentOfMeasurement) {
  Wire wire;
  wire.connect();
  wire.run_for(30ms);
  std::mt19937 random(5);
  wire.spoil = [&](Bytes& reply, Duration& delay) {
    delay = std::chrono::microseconds(20 + random() % 9000);
    const Duration until_measured = delay * (random() % 11) / 10;
    if (is_reply(reply, 50, 13)) {
      reply = fake::message(50, 13, 3, 0, fake::f32(to_seconds(wire.now + until_measured)));
    }
  };
  wire.run_for(30ms);
  wire.readings();
  wire.run_for(2s);
  int checked = 0;
  for (const Reading& reading : wire.readings()) {
    if (reading.quantity != Quantity::speed) continue;
    EXPECT_LE(std::abs(reading.value - to_seconds(reading.time)), to_seconds(reading.uncertainty) + 1e-6);
    ++checked;
  }
  EXPECT_GT(checked, 90);
}

TEST(Telemetry, KeepsABoundedNumberOfReadings) {
  Settings settings;
  settings.telemetry_hz = 10000;
  Wire wire(settings);
  wire.latency = 10us;
  wire.connect();
  wire.run_for(1s);
  EXPECT_EQ(wire.readings().size(), 4096u);
  EXPECT_GT(wire.session.counters().dropped_readings, 0u);
}

TEST(Replies, ThatComeLateNeverAnswerTheNextRequest) {
  // Alone: what a module answers later leaves after them.
  for (const double factor : {1.01, 1.5, 1.99, 5.0}) {
    Wire wire;
    wire.connect();
    wire.run_for(500ms);
    wire.readings();
    bool delayed = false;
    Instant line_free{0};
    wire.spoil = [&](Bytes& reply, Duration& delay) {
      if (!delayed && is_reply(reply, 50, 13)) {
        delayed = true;
        reply = fake::message(50, 13, 3, 0, fake::f32(999));
        delay = from_seconds(factor * to_seconds(kTimeout));
      }
      line_free = std::max(line_free, wire.now + delay);
      delay = line_free - wire.now;
    };
    wire.run_for(2s);
    EXPECT_GE(wire.session.counters().late_replies, 1u) << factor;
    EXPECT_EQ(wire.session.counters().late_replies, wire.session.counters().timeouts);
    const auto speeds = wire.values(Quantity::speed);
    EXPECT_EQ(std::count(speeds.begin(), speeds.end(), 999.0), 0) << factor;
    EXPECT_GT(static_cast<double>(speeds.size()), 90 - 5 * factor) << "and polling goes on behind it";
  }
}

TEST(Replies, OfALineThatStallsInOrderAreNeverTakenForLaterOnes) {
  // A true serial line keeps the order: while it stalls, nothing passes. Each value tells when it was asked.
  std::mt19937 random(11);
  Wire wire;
  wire.connect();
  wire.run_for(200ms);
  wire.readings();
  Instant line_free{0};
  wire.spoil = [&](Bytes& reply, Duration& delay) {
    if (is_reply(reply, 50, 13)) reply = fake::message(50, 13, 3, 0, fake::f32(to_seconds(wire.now)));
    Instant at = wire.now + 2ms;
    if (random() % 40 == 0) at += std::chrono::milliseconds(random() % 380);
    line_free = std::max(line_free, at);
    delay = line_free - wire.now;
  };
  wire.run_for(60s);
  EXPECT_GT(wire.session.counters().late_replies, 5u);
  int checked = 0;
  for (const Reading& reading : wire.readings()) {
    if (reading.quantity != Quantity::speed) continue;
    ++checked;
    const Instant asked = from_seconds(reading.value);
    EXPECT_LT(std::abs(to_seconds(asked - (reading.time - reading.uncertainty))), 1e-4) << checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(Replies, LeftUnreadByAHostThatSleptAreNotTakenForLaterOnes) {
  Wire wire;
  wire.connect();
  wire.run_for(500ms);
  Session& session = wire.session;
  while (session.output().empty()) {
    wire.now = session.deadline();
    session.advance(wire.now);
  }
  session.sent(session.output().size());
  wire.now += 800ms;
  session.advance(wire.now);  // the timers come first, then the bytes of before
  wire.readings();
  session.receive(fake::message(50, 13, 3, 0, fake::f32(111)), wire.now);
  EXPECT_TRUE(wire.values(Quantity::speed).empty());
  EXPECT_EQ(session.counters().late_replies, 1u);
}

TEST(Replies, ThatBeganToComeBeforeTheirQuestionAreSecondCopies) {
  for (const bool paced : {false, true}) {
    Settings settings;
    settings.slow_hz = 0.001;
    settings.wire_byte_time = paced ? 100us : 0us;
    settings.wire_paces = paced;
    Wire wire(settings);
    wire.latency = paced ? 6ms : 2ms;
    wire.connect();
    wire.run_for(500ms);
    wire.readings();
    wire.spoil = [&](Bytes& reply, Duration&) {
      if (!is_reply(reply, 50, 13)) return;
      const Bytes copy = fake::message(50, 13, 3, 0, fake::f32(999));
      // The next question follows 18 ms after this reply. On a line whose bytes take their time the copy may begin
      // together with it.
      wire.deliver(Bytes(copy.begin(), copy.begin() + 1), paced ? 20ms + 200us : 19ms);
      wire.deliver(Bytes(copy.begin() + 1, copy.end()), paced ? 20ms + 1200us : 21ms);
    };
    const auto before = wire.session.counters().unasked;
    wire.run_for(1s);
    const auto speeds = wire.values(Quantity::speed);
    EXPECT_GT(speeds.size(), 45u);
    EXPECT_EQ(std::count(speeds.begin(), speeds.end(), 999.0), 0) << paced;
    EXPECT_GT(wire.session.counters().unasked, before + 45);
  }
}

TEST(Replies, OfAnotherModuleAreRejectedAndCounted) {
  Wire wire;
  wire.connect();
  wire.run_for(100ms);
  wire.readings();
  wire.spoil = [](Bytes& reply, Duration&) {
    if (is_reply(reply, 50, 13)) reply = fake::message(50, 13, 3, 5, fake::f32(999));
  };
  wire.run_for(25ms);
  wire.readings();
  wire.run_for(500ms);
  EXPECT_TRUE(wire.values(Quantity::speed).empty());
  EXPECT_GT(wire.session.counters().wrong_module, 0u);
}

TEST(Replies, OfTheWrongLengthAreCountedAndNotStored) {
  Wire wire;
  wire.connect();
  wire.run_for(100ms);
  wire.readings();
  for (const Bytes& data : {Bytes{}, Bytes{1}, Bytes{1, 2, 3, 4, 5}, Bytes(57, 0)}) {
    const auto before = wire.session.counters().wrong_length;
    wire.module.values[{50, 13}] = data;
    wire.run_for(25ms);
    wire.readings();
    wire.run_for(200ms);
    EXPECT_TRUE(wire.values(Quantity::speed).empty()) << data.size();
    EXPECT_GT(wire.session.counters().wrong_length, before);
  }
}

TEST(Replies, ThatAreNoNumbersAreCountedAndNotStored) {
  Wire wire;
  wire.connect();
  wire.run_for(100ms);
  wire.readings();
  wire.module.values[{50, 13}] = fake::u32(0x7FC00000);
  wire.run_for(100ms);
  wire.module.values[{50, 13}] = fake::u32(0xFF800000);
  wire.run_for(100ms);
  for (const Reading& reading : wire.readings()) EXPECT_TRUE(std::isfinite(reading.value));
  EXPECT_GE(wire.session.counters().bad_values, 8u);
}

TEST(Replies, ToNothingThatWasAskedAreCounted) {
  Wire wire;
  wire.connect();
  wire.run_for(100ms);
  const auto before = wire.session.counters();
  wire.deliver(fake::message(50, 37, 3, 0, fake::f32(1)));
  wire.deliver(fake::message(50, 13, 0, 0));  // an echo of our own request
  wire.deliver(fake::message(200, 1, 3, 0));
  wire.deliver(fake::frame(7, {}));
  wire.run_for(1ms);
  EXPECT_EQ(wire.session.counters().unasked - before.unasked, 3u);
  EXPECT_EQ(wire.session.counters().unknown_entries - before.unknown_entries, 1u);
}

TEST(Resync, BringsTheNextReplyWithinOneTimeoutAfterAFalseHeader) {
  for (const std::uint8_t length : {0x0A, 0x1E, 0x3B}) {
    Wire wire;
    wire.connect();
    wire.run_for(100ms);
    wire.readings();
    const auto timeouts = wire.session.counters().timeouts;
    wire.deliver({0x55, length, 0x32});
    wire.run_for(kTimeout);
    EXPECT_GE(wire.values(Quantity::speed).size(), 4u) << int{length};
    EXPECT_EQ(wire.session.counters().timeouts, timeouts);
  }
}

TEST(Resync, WaitsForTheSecondHalfOfAFrameFromASlowAdapter) {
  Wire wire;
  wire.connect();
  wire.run_for(100ms);
  wire.readings();
  wire.spoil = [&](Bytes& reply, Duration& delay) {
    if (!is_reply(reply, 50, 13)) return;
    wire.deliver(Bytes(reply.begin() + 5, reply.end()), 16ms);
    reply.resize(5);
    delay = 1us;
  };
  wire.module.silent = {{69, 0}, {69, 1}, {50, 36}, {83, 0}, {50, 41}, {50, 0}, {5, 15}, {84, 1}, {50, 8}, {84, 0}};
  wire.run_for(200ms);
  EXPECT_GE(wire.values(Quantity::speed).size(), 9u);
  EXPECT_EQ(wire.session.counters().resyncs, 0u);
}

TEST(Timeouts, FollowTheMeasuredRoundTripBetweenTheirBounds) {
  Wire wire;
  wire.connect();
  EXPECT_EQ(wire.session.reply_timeout(), 40ms) << "a quick module: the shortest";
  wire.latency = 60ms;
  wire.run_for(3s);
  EXPECT_GT(wire.session.reply_timeout(), 60ms);
  EXPECT_LE(wire.session.reply_timeout(), 100ms);
  const auto timeouts = wire.session.counters().timeouts;
  wire.run_for(1s);
  EXPECT_EQ(wire.session.counters().timeouts, timeouts) << "it has learned";
  wire.latency = 2ms;
  wire.run_for(3s);
  EXPECT_EQ(wire.session.reply_timeout(), 40ms);
}

TEST(Timeouts, OfALostReplyCostOneGapOfThatEntryAndNoOther) {
  Wire wire;
  wire.connect();
  wire.run_for(500ms);
  wire.readings();
  bool lost = false;
  wire.spoil = [&](Bytes& reply, Duration&) {
    if (!std::exchange(lost, lost || is_reply(reply, 50, 13)) && is_reply(reply, 50, 13)) reply.clear();
  };
  wire.run_for(1s);
  EXPECT_EQ(wire.session.counters().timeouts, 1u);
  const auto readings = wire.readings();
  const auto speeds =
      std::count_if(readings.begin(), readings.end(), [](const Reading& r) { return r.quantity == Quantity::speed; });
  EXPECT_GE(speeds, 50 - 4) << "a time-out of 40 ms at 50 Hz: others have overtaken it by then";
  EXPECT_GE(readings.size() - static_cast<std::size_t>(speeds), 49u);
}

TEST(RoundTrips, AreToldWhenTheyBlurReadingsInTime) {
  for (const Duration latency : {2ms, 16ms}) {
    Wire wire;
    wire.latency = latency;
    wire.connect();
    wire.run_for(5s);
    EXPECT_NEAR(to_seconds(wire.session.round_trips().quantile(0.5)), to_seconds(latency), 0.1 * to_seconds(latency));
    const auto events = wire.session.take_events();
    const auto slow = std::count_if(events.begin(), events.end(),
                                    [](const Event& e) { return e.kind == EventKind::slow_round_trip; });
    EXPECT_EQ(slow, latency > 4ms ? 1 : 0);
  }
}

TEST(Telemetry, CarriesItsThreeStamps) {
  Settings settings;
  settings.wire_byte_time = 100us;
  Wire wire(settings);
  wire.latency = 5ms;
  wire.connect();
  wire.run_for(1s);
  wire.readings();
  wire.batches.clear();
  while (wire.batches.empty()) wire.run_for(1ms);
  wire.run_for(6ms);
  bool seen = false;
  for (const Reading& reading : wire.readings()) {
    if (reading.quantity != Quantity::speed || reading.stamps.sent != wire.batches[0].first) continue;
    seen = true;
    EXPECT_EQ(reading.stamps.parsed, wire.batches[0].first + 5ms);
    EXPECT_EQ(reading.stamps.first_byte, reading.stamps.parsed - 10 * 100us) << "11 bytes, the last one just now";
  }
  EXPECT_TRUE(seen);
}

TEST(Telemetry, AsksForAllThatIsWantedInEveryCycle) {
  Settings settings;
  settings.telemetry_hz = 100;
  settings.slow_hz = 10;
  settings.every_cycle = {Quantity::speed, Quantity::motor_current, Quantity::supply_voltage, Quantity::supply_current};
  Wire wire(settings);
  wire.connect();
  wire.run_for(100ms);
  wire.readings();
  wire.run_for(1s);
  std::map<Quantity, int> count;
  for (const Reading& reading : wire.readings()) ++count[reading.quantity];
  for (const Quantity quantity : settings.every_cycle) EXPECT_NEAR(count[quantity], 100, 1) << name_of(quantity);
  EXPECT_NEAR(count[Quantity::coil_temperature] + count[Quantity::derate] + count[Quantity::drive_mode] +
                  count[Quantity::drive_pwm] + count[Quantity::fault_now],
              10, 1);
}

struct Restart {
  const char* name;
  void (*happen)(fake::Module&);
};

class EveryRestart : public testing::TestWithParam<Restart> {};

TEST_P(EveryRestart, IsNoticedNamedAndNeverFollowedByMotion) {
  Wire wire;
  wire.connect();
  wire.spin(1000);
  wire.run_for(600ms);
  EXPECT_EQ(wire.session.state(), State::ready);
  (void)wire.session.take_events();
  const auto speeds = [&] { return wire.module.count([](const auto& m) { return m.is_speed(); }); };
  const auto before = speeds();
  GetParam().happen(wire.module);
  ASSERT_TRUE(wire.run_to_state(State::failed, 300ms));
  const auto events = wire.session.take_events();
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].kind, EventKind::module_reset);
  EXPECT_TRUE(spoils_a_run(events[0].kind));
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

INSTANTIATE_TEST_SUITE_P(Session, EveryRestart,
                         testing::Values(Restart{"UptimeGoesBackwards", [](fake::Module& m) { m.restart(); }},
                                         Restart{"UnderVoltageBit",
                                                 [](fake::Module& m) {
                                                   m.values[{84, 1}] = fake::u8(1);
                                                 }}),
                         [](const auto& restart) { return std::string(restart.param.name); });

TEST(Restarts, AreNotSeenInOtherFaultsNorInBitsOfBefore) {
  Wire wire;
  wire.module.values[{84, 1}] = fake::u8(0x01);
  wire.connect();
  wire.module.values[{84, 1}] = fake::u8(0x41);
  wire.run_for(2s);
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Restarts, AreNotSeenWhenTheTimeIsSet) {
  Wire wire;
  wire.connect();
  wire.run_for(1s);
  wire.session.inquire({{find("system_control.time"), 0.0}}, wire.now);
  wire.flush();
  wire.run_for(2s);
  EXPECT_EQ(wire.session.state(), State::ready) << wire.session.failure();
  EXPECT_TRUE(wire.session.inquiries().replies().at(0).accepted);
}

TEST(Rearming, IsRefusedUnlessReady) {
  Wire wire;
  EXPECT_THROW(wire.session.rearm(), std::logic_error);
  wire.connect();
  EXPECT_TRUE(wire.session.armed()) << "the first connection arms";
  wire.session.fail(EventKind::port_lost, "unplugged", wire.now);
  EXPECT_THROW(wire.session.rearm(), std::logic_error);
  EXPECT_FALSE(wire.session.armed());
}

TEST(Reconnecting, SendsNothingOfBefore) {
  Wire wire;
  wire.connect();
  wire.session.spin_at(RadPerSec(700), wire.now);
  wire.session.sent(3);  // the rest has not left when the plug is pulled
  wire.session.fail(EventKind::port_lost, "unplugged", wire.now);
  wire.session.connect_anew(wire.now + 1s);
  wire.now += 1s;
  EXPECT_EQ(fake::hex(wire.session.output().first(7)), "55 02 34 02 01 8E 06") << "a whole coast, not half a speed";
  wire.flush();
  ASSERT_TRUE(wire.run_to_state(State::ready, 1s));
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.is_speed(); }), 0u);
}

TEST(Reconnecting, RefusesAnotherModuleBeforeTellingItAnythingButCoast) {
  Wire wire;
  wire.connect();
  wire.session.fail(EventKind::port_lost, "unplugged", wire.now);
  wire.module.heard.clear();
  wire.module.values[{5, 6}] = fake::u32(0x99999999);
  wire.session.connect_anew(wire.now);
  wire.flush();
  ASSERT_TRUE(wire.run_to_state(State::failed, 1s));
  EXPECT_NE(wire.session.failure().find("another module answers, uid 111111112222222299999999"), std::string::npos)
      << wire.session.failure();
  EXPECT_EQ(wire.session.take_events().back().kind, EventKind::another_module);
  EXPECT_EQ(wire.module.count([](const auto& m) { return m.access == 1 && !m.is_coast(); }), 0u);
}

TEST(OldFirmware, AnswersForItsSystemOnIdZero) {
  Settings settings;
  settings.module_id = 7;
  Wire wire(settings);
  wire.module.id = 7;
  wire.module.values[{5, 14}] = fake::u8(7);
  wire.module.old_system_control = true;
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::ready, 3s)) << wire.session.failure();
  EXPECT_EQ(wire.session.identity().system_control_id, 0);
  EXPECT_EQ(wire.session.identity().uid1, 0x11111111u);
  wire.run_for(1s);
  EXPECT_EQ(wire.session.counters().wrong_module, 0u);
  wire.module.restart();
  EXPECT_TRUE(wire.run_to_state(State::failed, 400ms)) << "its uptime is read there too";
}

TEST(OldFirmware, IsNotTakenForModuleZeroWhenItsOtherClientsHaveAnotherId) {
  Wire wire;
  wire.module.values[{5, 14}] = fake::u8(7);
  wire.session.connect(wire.now);
  ASSERT_TRUE(wire.run_to_state(State::failed, 1s));
  EXPECT_NE(wire.session.failure().find("set module_id to 7"), std::string::npos) << wire.session.failure();
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

TEST(Inquiries, AreAnsweredBetweenThePolls) {
  Wire wire;
  wire.connect();
  wire.session.inquire({{find("brushless_drive.motor_Kv"), {}},
                        {find("power_monitor.volts"), {}},
                        {find("coil_temperature_estimator.otw"), {}},
                        {find("propeller_motor_control.timeout"), 0.25}},
                       wire.now);
  EXPECT_THROW(wire.session.inquire({}, wire.now), std::logic_error) << "one after the other";
  wire.flush();
  wire.run_for(5s);
  ASSERT_TRUE(wire.session.inquiries().done());
  const auto& replies = wire.session.inquiries().replies();
  EXPECT_EQ(replies[0].value, 2200.0);
  EXPECT_EQ(replies[1].value, 12.5);
  EXPECT_EQ(replies[2].value, std::nullopt) << "this module has no such entry";
  EXPECT_EQ(replies[3].value, 0.25);
  EXPECT_TRUE(replies[3].accepted);
  EXPECT_EQ(wire.session.state(), State::ready);
}

TEST(Inquiries, TellWhenASettingIsNotTakenBitByBit) {
  Wire wire;
  wire.module.values[{52, 12}] = fake::f32(4.0e-7);
  wire.module.read_only = {{52, 12}};
  wire.connect();
  wire.session.inquire({{find("propeller_motor_control.velocity_ff2"), 5.0e-7}}, wire.now);
  wire.flush();
  wire.run_for(1s);
  EXPECT_FALSE(wire.session.inquiries().replies().at(0).accepted);
}

TEST(Inquiries, NeverMoveSaveEraseOrRename) {
  Wire wire;
  wire.connect();
  for (const char* path :
       {"propeller_motor_control.ctrl_velocity", "propeller_motor_control.ctrl_pwm",
        "propeller_motor_control.ctrl_volts", "brushless_drive.phase_angle", "brushless_drive.drive_volts_addition",
        "brushless_drive.calibration_angle", "system_control.module_id", "serial_interface.baud_rate",
        "esc_propeller_input_parser.raw_value", "arming_handler.motor_armed"}) {
    const Entry* entry = find(path);
    if (entry == nullptr || !entry->allows(Access::get)) continue;
    EXPECT_FALSE(is_volatile_setting(*entry)) << path;
    EXPECT_THROW(wire.session.inquire({{entry, 1.0}}, wire.now), std::invalid_argument) << path;
  }
  for (const Entry& entry : kEntries) {
    const bool moves = entry.name.substr(0, 5) == "ctrl_" || entry.type == Client::persistent_memory;
    EXPECT_FALSE(moves && is_volatile_setting(entry)) << entry.name;
  }
  EXPECT_THROW(wire.session.inquire({{find("propeller_motor_control.ctrl_coast"), {}}}, wire.now),
               std::invalid_argument);
}

TEST(Soak, ARuinedLineNeverBringsAFalseValueAndNeverMotionAfterACoast) {
  for (unsigned seed = 1; seed <= 60; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](int in) { return static_cast<int>(random() % static_cast<unsigned>(in)) == 0; };
    Wire wire;
    wire.connect();
    wire.spoil = [&](Bytes& reply, Duration& delay) {
      if (chance(20)) reply[random() % reply.size()] ^= static_cast<std::uint8_t>(1u << random() % 8);
      if (chance(30)) reply.resize(random() % reply.size());
      if (chance(30)) reply.insert(reply.begin(), {0x55, static_cast<std::uint8_t>(random() % 64), 0x32});
      if (chance(40)) delay += std::chrono::milliseconds(random() % 90);
      if (chance(60)) reply.clear();
    };
    wire.module.values[{50, 13}] = fake::f32(0);
    for (int i = 0; i < 60; ++i) {
      if (wire.session.state() == State::ready && chance(3)) wire.spin(100);
      if (chance(4)) wire.coast();
      wire.run_for(std::chrono::milliseconds(random() % 40));
      if (!wire.session.spinning() && wire.module.last_motion() != nullptr) {
        ASSERT_TRUE(wire.module.last_motion()->is_coast()) << "seed " << seed;
      }
    }
    wire.coast();
    wire.spoil = nullptr;
    wire.run_for(4s);
    EXPECT_TRUE(wire.module.last_motion()->is_coast()) << "seed " << seed;
    EXPECT_TRUE(wire.session.coasting()) << "seed " << seed;
    for (const Reading& reading : wire.readings()) {
      ASSERT_TRUE(reading.quantity != Quantity::speed || reading.value == 0 || reading.value == 100)
          << "seed " << seed << ": " << reading.value;
      ASSERT_TRUE(reading.quantity != Quantity::supply_voltage || reading.value == 12.5) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace kphi::iq
