#include "drivers/iq/exchange/requests.hpp"

#include <gtest/gtest.h>

#include <numeric>

namespace kphi::iq {
namespace {

using namespace std::chrono_literals;

TEST(AdaptiveTimeout, BeginsAtTheLongestAndFollowsRfc6298) {
  AdaptiveTimeout timeout(1ms, 1s);
  EXPECT_EQ(timeout.timeout(), 1s);
  timeout.measured(10ms);
  EXPECT_EQ(timeout.timeout(), 30ms) << "R + 4 R/2";
  timeout.measured(18ms);
  // RTTVAR = 3/4 5 + 1/4 8 = 5.75 ms, SRTT = 7/8 10 + 1/8 18 = 11 ms
  EXPECT_EQ(timeout.smoothed(), 11ms);
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

TEST(RoundTripHistogram, TellsQuantilesWithinTenPercent) {
  RoundTripHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0ms);
  for (int i = 1; i <= 1000; ++i) histogram.add(i * 10us);
  EXPECT_NEAR(to_seconds(histogram.quantile(0.5)), 5e-3, 0.5e-3);
  EXPECT_NEAR(to_seconds(histogram.quantile(0.99)), 9.9e-3, 1e-3);
  EXPECT_EQ(histogram.count(), 1000u);
}

TEST(RoundTripHistogram, KeepsWhatIsBeyondItsEnds) {
  RoundTripHistogram histogram;
  histogram.add(0ns);
  histogram.add(3600s);
  EXPECT_EQ(histogram.buckets().front(), 1u);
  EXPECT_EQ(histogram.buckets().back(), 1u);
  const auto& buckets = histogram.buckets();
  EXPECT_EQ(std::accumulate(buckets.begin(), buckets.end(), 0u), 2u);
}

}  // namespace
}  // namespace kphi::iq
