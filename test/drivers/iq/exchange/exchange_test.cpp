#include "drivers/iq/exchange/exchange.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <stdexcept>

#include "test/drivers/iq/wire.hpp"

namespace kphi::iq {
namespace exchange_test {

using namespace std::chrono_literals;
using fake::Bytes;
using fake::Connected;
using fake::is_reply;
using fake::Wire;

constexpr Duration kTimeout = 100ms;

TEST(Replies, ThatComeLateNeverAnswerTheNextRequest) {
  // Alone: what a module answers later leaves after them.
  for (const double factor : {1.01, 1.5, 1.99, 5.0}) {
    Connected wire(500ms);
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
    const auto speeds = wire.values(MotorChannel::speed);
    EXPECT_EQ(std::count(speeds.begin(), speeds.end(), 999.0), 0) << factor;
    EXPECT_GT(static_cast<double>(speeds.size()), 90 - 5 * factor) << "and polling goes on behind it";
  }
}

TEST(Replies, OfALineThatStallsInOrderAreNeverTakenForLaterOnes) {
  // A true serial line keeps the order: while it stalls, nothing passes. Each value tells when it was asked.
  std::mt19937 random(11);
  Connected wire(200ms);
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
  for (const MotorReading& reading : wire.readings()) {
    if (reading.channel != MotorChannel::speed) continue;
    ++checked;
    const Instant asked = from_seconds(reading.value);
    EXPECT_LT(std::abs(to_seconds(asked - Instant(reading.time_ns - reading.uncertainty_ns))), 1e-4) << checked;
  }
  EXPECT_GT(checked, 100);
}

TEST(Replies, LeftUnreadByAHostThatSleptAreNotTakenForLaterOnes) {
  Connected wire(500ms);
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
  EXPECT_TRUE(wire.values(MotorChannel::speed).empty());
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
    const auto speeds = wire.values(MotorChannel::speed);
    EXPECT_GT(speeds.size(), 45u);
    EXPECT_EQ(std::count(speeds.begin(), speeds.end(), 999.0), 0) << paced;
    EXPECT_GT(wire.session.counters().unasked, before + 45);
  }
}

TEST(Replies, OfAnotherModuleAreRejectedAndCounted) {
  Connected wire(100ms);
  wire.spoil = [](Bytes& reply, Duration&) {
    if (is_reply(reply, 50, 13)) reply = fake::message(50, 13, 3, 5, fake::f32(999));
  };
  wire.run_for(25ms);
  wire.readings();
  wire.run_for(500ms);
  EXPECT_TRUE(wire.values(MotorChannel::speed).empty());
  EXPECT_GT(wire.session.counters().wrong_module, 0u);
}

TEST(Replies, OfTheWrongLengthAreCountedAndNotStored) {
  Connected wire(100ms);
  for (const Bytes& data : {Bytes{}, Bytes{1}, Bytes{1, 2, 3, 4, 5}, Bytes(57, 0)}) {
    const auto before = wire.session.counters().wrong_length;
    wire.module.values[{50, 13}] = data;
    wire.run_for(25ms);
    wire.readings();
    wire.run_for(200ms);
    EXPECT_TRUE(wire.values(MotorChannel::speed).empty()) << data.size();
    EXPECT_GT(wire.session.counters().wrong_length, before);
  }
}

TEST(Replies, ThatAreNoNumbersAreCountedAndNotStored) {
  Connected wire(100ms);
  wire.module.values[{50, 13}] = fake::u32(0x7FC00000);
  wire.run_for(100ms);
  wire.module.values[{50, 13}] = fake::u32(0xFF800000);
  wire.run_for(100ms);
  for (const MotorReading& reading : wire.readings()) EXPECT_TRUE(std::isfinite(reading.value));
  EXPECT_GE(wire.session.counters().bad_values, 8u);
}

TEST(Replies, ToNothingThatWasAskedAreCounted) {
  Connected wire(100ms);
  const auto before = wire.session.counters();
  wire.deliver(fake::message(50, 37, 3, 0, fake::f32(1)));
  wire.deliver(fake::message(50, 13, 0, 0));  // an echo of our own request
  wire.deliver(fake::message(200, 1, 3, 0));
  wire.deliver(fake::frame(7, {}));
  wire.run_for(1ms);
  EXPECT_EQ(wire.session.counters().unasked - before.unasked, 4u);
}

TEST(Resync, BringsTheNextReplyWithinOneTimeoutAfterAFalseHeader) {
  for (const std::uint8_t length : {0x0A, 0x1E, 0x3B}) {
    Connected wire(100ms);
    const auto timeouts = wire.session.counters().timeouts;
    wire.deliver({0x55, length, 0x32});
    wire.run_for(kTimeout);
    EXPECT_GE(wire.values(MotorChannel::speed).size(), 4u) << int{length};
    EXPECT_EQ(wire.session.counters().timeouts, timeouts);
  }
}

TEST(Resync, WaitsForTheSecondHalfOfAFrameFromASlowAdapter) {
  Connected wire(100ms);
  wire.spoil = [&](Bytes& reply, Duration& delay) {
    if (!is_reply(reply, 50, 13)) return;
    wire.deliver(Bytes(reply.begin() + 5, reply.end()), 16ms);
    reply.resize(5);
    delay = 1us;
  };
  wire.module.silent = {{69, 0}, {69, 1}, {50, 36}, {83, 0}, {50, 41}, {50, 0}, {5, 15}, {84, 1}, {50, 8}, {84, 0}};
  wire.run_for(200ms);
  EXPECT_GE(wire.values(MotorChannel::speed).size(), 9u);
  EXPECT_EQ(wire.session.counters().resyncs, 0u);
}

TEST(Timeouts, FollowTheMeasuredRoundTripBetweenTheirBounds) {
  Connected wire;
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
  Connected wire(500ms);
  bool lost = false;
  wire.spoil = [&](Bytes& reply, Duration&) {
    if (!std::exchange(lost, lost || is_reply(reply, 50, 13)) && is_reply(reply, 50, 13)) reply.clear();
  };
  wire.run_for(1s);
  EXPECT_EQ(wire.session.counters().timeouts, 1u);
  const auto readings = wire.readings();
  const auto speeds = std::count_if(readings.begin(), readings.end(),
                                    [](const MotorReading& r) { return r.channel == MotorChannel::speed; });
  EXPECT_GE(speeds, 50 - 4) << "a time-out of 40 ms at 50 Hz: others have overtaken it by then";
  EXPECT_GE(readings.size() - static_cast<std::size_t>(speeds), 49u);
}

/// That are told of a slow line, since the last call.
std::ptrdiff_t slow_lines(Session& session) {
  const auto events = session.take_events();
  return std::ranges::count(events, EventKind::motor_slow_round_trip, &StreamEvent::kind);
}

TEST(RoundTrips, AreToldWhenTheyBlurReadingsInTime) {
  for (const Duration latency : {2ms, 16ms}) {
    Wire wire;
    wire.latency = latency;
    wire.connect();
    wire.run_for(5s);
    EXPECT_GE(wire.session.round_trips().quantile(0.5), latency);
    EXPECT_LE(wire.session.round_trips().quantile(0.5), latency * 9 / 8);
    EXPECT_EQ(slow_lines(wire.session), latency > 4ms ? 1 : 0);
  }
}

TEST(RoundTrips, AreJudgedAnewForEachSpin) {
  for (const Duration latency : {2ms, 16ms}) {
    Wire wire;
    wire.latency = latency;
    wire.connect();
    wire.run_for(5s);
    for (int spin = 0; spin < 3; ++spin) {
      (void)slow_lines(wire.session);
      wire.session.spin_at(RadPerSec(500), wire.now);
      wire.run_for(5s);
      wire.session.emergency_stop(wire.now);
      wire.run_for(1s);
      EXPECT_EQ(slow_lines(wire.session), latency > 4ms ? 1 : 0) << "spin " << spin;
    }
  }
}

TEST(AdaptiveTimeout, BeginsAtTheLongestAndFollowsRfc6298) {
  AdaptiveTimeout timeout(1ms, 1s);
  EXPECT_EQ(timeout.timeout(), 1s);
  timeout.measured(10ms);
  EXPECT_EQ(timeout.timeout(), 30ms) << "R + 4 R/2";
  timeout.measured(18ms);
  // RTTVAR = 3/4 5 + 1/4 8 = 5.75 ms, SRTT = 7/8 10 + 1/8 18 = 11 ms
  EXPECT_EQ(timeout.timeout(), 34ms);
}

TEST(AdaptiveTimeout, StaysWithinItsBounds) {
  AdaptiveTimeout timeout(40ms, 100ms);
  for (int i = 0; i < 100; ++i) timeout.measured(1ms);
  EXPECT_EQ(timeout.timeout(), 40ms);
  for (int i = 0; i < 100; ++i) timeout.measured(5s);
  EXPECT_EQ(timeout.timeout(), 100ms);
}

TEST(AdaptiveTimeout, DoublesOncePerRowOfTimeouts) {
  AdaptiveTimeout timeout(10ms, 100ms);
  for (int i = 0; i < 100; ++i) timeout.measured(1ms);
  timeout.timed_out(0ms, 10ms);
  timeout.timed_out(1ms, 11ms);  // was sent before the doubling
  EXPECT_EQ(timeout.timeout(), 20ms);
  timeout.timed_out(12ms, 32ms);
  timeout.timed_out(33ms, 73ms);
  EXPECT_EQ(timeout.timeout(), 80ms);
  timeout.timed_out(80ms, 160ms);
  EXPECT_EQ(timeout.timeout(), 100ms);
  timeout.measured(1ms);
  EXPECT_EQ(timeout.timeout(), 10ms);
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

}  // namespace exchange_test
}  // namespace kphi::iq
