#include "base/clock.hpp"

#include <gtest/gtest.h>

namespace kphi::clock_test {

using namespace std::chrono_literals;

timespec realtime_now() {
  timespec t{};
  clock_gettime(CLOCK_REALTIME, &t);
  return t;
}

TEST(Clock, SecondsRoundTripThroughDurations) {
  EXPECT_EQ(from_seconds(1.5), 1500ms);
  EXPECT_EQ(from_seconds(-1e-9), -1ns);
  EXPECT_EQ(from_seconds(0.1), 100ms);
  EXPECT_DOUBLE_EQ(to_seconds(250ms), 0.25);
}

TEST(SteadyClock, StartsAtItsOwnEpoch) {
  const SteadyClock clock;
  EXPECT_GE(clock.now(), 0ns);
  EXPECT_LT(clock.now(), 60s);
}

TEST(SteadyClock, NeverRunsBackwards) {
  const SteadyClock clock(16.0);
  Instant before = clock.now();
  for (int i = 0; i < 10000; ++i) {
    const Instant now = clock.now();
    ASSERT_GE(now, before);
    before = now;
  }
}

TEST(SteadyClock, StretchesWallTimeByItsScaleAndShrinksItBack) {
  const SteadyClock clock(20.0);
  EXPECT_EQ(clock.stretched(50ms), 1s);
  EXPECT_EQ(clock.shrunk(1s), 50ms);
  EXPECT_EQ(SteadyClock().stretched(50ms), 50ms);
}

TEST(SteadyClock, RunsAtItsScale) {
  const SteadyClock plain(1.0);
  const SteadyClock fast(100.0);
  // Readings nest, so that a preemption between two of them cannot turn an inequality around.
  const Instant outer_before = plain.now();
  const Instant fast_before = fast.now();
  const Instant inner_before = plain.now();
  Instant inner_after = inner_before;
  while (inner_after - inner_before < 2ms) inner_after = plain.now();
  const Instant fast_after = fast.now();
  const Instant outer_after = plain.now();
  EXPECT_GE(fast_after - fast_before + 200ns, 100 * (inner_after - inner_before));
  EXPECT_LE(fast_after - fast_before - 200ns, 100 * (outer_after - outer_before));
}

TEST(SteadyClock, PlacesAKernelStampBetweenTheReadingsAroundIt) {
  for (const double scale : {1.0, 20.0}) {
    const SteadyClock clock(scale);
    const Instant before = clock.now();
    const timespec stamp = realtime_now();
    const Instant after = clock.now();
    const Instant placed = clock.at_realtime(stamp);
    // The two clocks are read one after the other: a preemption between them moves the stamp. 50 ms is such a one.
    EXPECT_GE(placed, before - clock.stretched(50ms)) << scale;
    EXPECT_LE(placed, after + clock.stretched(50ms)) << scale;
  }
}

TEST(SteadyClock, PlacesAnOlderStampEarlierByItsAge) {
  const SteadyClock clock(4.0);
  timespec stamp = realtime_now();
  const Instant recent = clock.at_realtime(stamp);
  stamp.tv_sec -= 1;
  const Duration age = recent - clock.at_realtime(stamp);
  EXPECT_NEAR(to_seconds(age), 4.0, 0.2);
}

TEST(SteadyClock, KnowsTheCalendarTimeOfItsEpoch) {
  const auto before = std::chrono::system_clock::now();
  const SteadyClock clock(20.0);
  const auto after = std::chrono::system_clock::now();
  EXPECT_GE(clock.epoch_utc(), before - 1s);
  EXPECT_LE(clock.epoch_utc(), after + 1s);
}

TEST(ManualClock, StandsStillUntilTold) {
  ManualClock clock(5s);
  EXPECT_EQ(clock.now(), 5s);
  EXPECT_EQ(clock.now(), 5s);
  clock.advance(3ms);
  EXPECT_EQ(clock.now(), 5s + 3ms);
  clock.set(1s);
  EXPECT_EQ(clock.now(), 1s);
  EXPECT_EQ(clock.at_realtime(realtime_now()), 1s);
}

TEST(ManualClock, HasTheSameEpochInEveryRun) {
  EXPECT_EQ(std::chrono::system_clock::to_time_t(ManualClock().epoch_utc()), 1622332800);
  EXPECT_EQ(ManualClock(7s).epoch_utc(), ManualClock().epoch_utc());
}

}  // namespace kphi::clock_test
