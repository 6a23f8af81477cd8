#include <gtest/gtest.h>

#include "drivers/netbox/stream/health.hpp"
#include "test/drivers/netbox/delay_channel.hpp"

namespace kphi::netbox::clock_estimate_test {

using namespace std::chrono_literals;

using namespace test;

TEST(ClockEstimate, StaysWithinFiveMicrosecondsOnALoadedHost) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    Channel channel({}, seed);
    ClockEstimate estimate(kRate);
    const Quality quality = quality_of(channel, estimate, 240);
    EXPECT_LT(quality.rms_us, 5) << "seed " << seed;
    EXPECT_NEAR(estimate.skew_ppm(), 60, 2) << seed;
    EXPECT_LT(std::abs(estimate.skew_ppm()), ClockEstimate::kBelievableSkewPpm);
    EXPECT_LT(to_seconds(estimate.uncertainty()), 10e-6) << seed;
  }
}

TEST(ClockEstimate, StaysWithinFiveMicrosecondsOnEveryHostInEveryMode) {
  for (const test::ChannelCase& c : test::channel_cases()) {
    Channel channel(c.manner, 1);
    ClockEstimate estimate(kRate);
    const Quality quality = quality_of(channel, estimate, 240);
    EXPECT_LT(quality.spread_us(), 5) << c.name << ", wander " << c.manner.wander_ppm;
    EXPECT_LT(std::abs(quality.mean_us), 10) << c.name << ": the least delay of half a second is no constant";
    EXPECT_NEAR(estimate.skew_ppm(), 60, 2) << c.name;
  }
}

TEST(ClockEstimate, FindsANegativeSkewToo) {
  Channel channel({.skew_ppm = -60}, 2);
  ClockEstimate estimate(kRate);
  EXPECT_LT(quality_of(channel, estimate, 120).rms_us, 5);
  EXPECT_NEAR(estimate.skew_ppm(), -60, 3);
}

TEST(ClockEstimate, DoesNotNoticeTheWrap) {
  Channel channel({}, 3, 0xffffffffu - 40 * 7000);
  ClockEstimate estimate(kRate);
  EXPECT_LT(quality_of(channel, estimate, 120).rms_us, 5);
}

TEST(ClockEstimate, IsNotReadyBeforeFourBinsAndSaysHowLittleItKnows) {
  Channel channel({}, 4);
  ClockEstimate estimate(kRate);
  Channel::Sample sample = channel.next();
  for (; sample.true_s < 1.9; sample = channel.next()) estimate.add(sample.ft, sample.arrival);
  EXPECT_EQ(estimate.skew_ppm(), 0);
  EXPECT_GT(to_seconds(estimate.uncertainty()), 1e-3);
  const Duration late = estimate.add(sample.ft, sample.arrival);
  EXPECT_NEAR(to_seconds(sample.arrival - late - 100s), sample.true_s, 1e-3);
  for (; sample.true_s < 2.1; sample = channel.next()) estimate.add(sample.ft, sample.arrival);
  EXPECT_NE(estimate.skew_ppm(), 0);
}

TEST(ClockEstimate, ForgetsEverythingWhenTheBoxBootsAnew) {
  ClockEstimate estimate(kRate);
  Channel before({}, 5);
  static_cast<void>(quality_of(before, estimate, 60));
  estimate.restart();
  EXPECT_EQ(estimate.skew_ppm(), 0);
  Channel after({.skew_ppm = 40}, 6, 17);
  EXPECT_LT(quality_of(after, estimate, 120).rms_us, 5);
  EXPECT_NEAR(estimate.skew_ppm(), 40, 3);
}

TEST(ClockEstimate, DoubtsARateThatIsAnotherThanConfigured) {
  ClockEstimate estimate(kRate);
  Channel channel({.skew_ppm = 3000}, 7);
  static_cast<void>(quality_of(channel, estimate, 31));
  EXPECT_GT(estimate.skew_ppm(), ClockEstimate::kBelievableSkewPpm);
}

}  // namespace kphi::netbox::clock_estimate_test
