#include "drivers/netbox/stream/health.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "base/published.hpp"

namespace kphi::netbox {
namespace {

using namespace std::chrono_literals;

StampedRecord at(std::uint32_t ft, Instant arrival) {
  StampedRecord stamped;
  stamped.record.ft_sequence = ft;
  stamped.arrival = arrival;
  return stamped;
}

TEST(DelayHistogram, QuantilesAreAtMostAnEighthTooHigh) {
  DelayHistogram histogram;
  for (std::int64_t ns = 1; ns <= 1'000'000; ns += 7) histogram.add(Duration(ns));
  for (const double share : {0.1, 0.5, 0.9, 0.99}) {
    const double told = static_cast<double>(histogram.quantile(share).count());
    EXPECT_GE(told, 0.999 * share * 1e6) << share;
    EXPECT_LE(told, 1.126 * share * 1e6) << share;
  }
}

TEST(DelayHistogram, TakesWhateverComes) {
  DelayHistogram histogram;
  EXPECT_EQ(histogram.quantile(0.5), 0ns);
  histogram.add(-5ns);
  EXPECT_EQ(histogram.quantile(0.5), 0ns);
  histogram.add(Duration::max());
  EXPECT_GT(histogram.quantile(0.99), 1h);
  EXPECT_EQ(histogram.total(), 2u);
  histogram.clear();
  EXPECT_EQ(histogram.total(), 0u);
}

TEST(HealthMeter, TellsRatesAndJitter) {
  HealthMeter meter(7000);
  meter.begin();
  for (std::uint32_t i = 0; i <= 1750; ++i) {  // 10 s of 40-record datagrams; each fiftieth comes 3 ms late
    const Duration late = i % 50 == 49 ? 3ms : 0ms;
    meter.note(at(40 * i, 1s + from_seconds(40 * i / 7000.0) + late), 40, 0);
  }
  const Health health = meter.health();
  EXPECT_NEAR(health.records_per_second, 7000, 1);
  EXPECT_NEAR(health.datagrams_per_second, 175, 0.1);
  EXPECT_LT(health.jitter_p50_ns, 10'000);
  EXPECT_NEAR(static_cast<double>(health.jitter_p99_ns), 3e6, 0.4e6);
  EXPECT_NEAR(health.skew_ppm, 0, 0.1);
}

TEST(HealthMeter, BeginsItsClockAnewAfterAReboot) {
  HealthMeter meter(7000);
  meter.begin();
  for (std::uint32_t i = 0; i < 700; ++i) meter.note(at(40 * i, 1s + from_seconds(40 * i / 6999.3)), 40, 0);
  EXPECT_NEAR(meter.health().skew_ppm, 100, 1);
  meter.note(at(40, 10s), 40, 1);
  EXPECT_EQ(meter.health().skew_ppm, 0);
}

TEST(HealthMeter, RemembersTheFullestQueue) {
  HealthMeter meter(7000);
  for (const std::uint64_t waiting : {3u, 900u, 20u}) meter.note_queue(waiting);
  EXPECT_EQ(meter.health().queue_high_water, 900u);
}

TEST(Published, IsReadWholeWhileItIsWritten) {
  struct Four {
    std::uint64_t words[4];
  };
  Published<Four> published;
  std::atomic<bool> ending{false};
  std::thread writer([&] {
    for (std::uint64_t i = 0; !ending; ++i) published.publish({{i, i, i, i}});
  });
  for (int i = 0; i < 100'000; ++i) {
    const Four four = published.read();
    ASSERT_TRUE(four.words[0] == four.words[1] && four.words[1] == four.words[2] && four.words[2] == four.words[3]);
  }
  ending = true;
  writer.join();
}

}  // namespace
}  // namespace kphi::netbox
