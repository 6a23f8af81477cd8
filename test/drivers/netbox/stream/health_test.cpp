#include "drivers/netbox/stream/health.hpp"

#include <gtest/gtest.h>

#include <thread>

#include "base/published.hpp"

namespace kphi::netbox::health_test {

using namespace std::chrono_literals;

LoadCellRecord at(std::uint32_t ft, Instant arrival) {
  LoadCellRecord stamped;
  stamped.ft_sequence = ft;
  stamped.arrival_ns = arrival.count();
  return stamped;
}

TEST(HealthMeter, TellsRatesAndJitter) {
  HealthMeter meter(7000);
  meter.begin();
  for (std::uint32_t i = 0; i <= 1750; ++i) {  // 10 s of 40-record datagrams; each fiftieth comes 3 ms late
    const Duration late = i % 50 == 49 ? 3ms : 0ms;
    meter.note(at(40 * i, 1s + from_seconds(40 * i / 7000.0) + late), 40, 0);
  }
  const StreamHealth health = meter.health();
  EXPECT_NEAR(health.records_per_second, 7000, 1);
  EXPECT_NEAR(health.datagrams_per_second, 175, 0.1);
  EXPECT_LT(health.jitter_p50_s, 10e-6);
  EXPECT_NEAR(health.jitter_p99_s, 3e-3, 0.4e-3);
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

TEST(Published, KeepsNoReaderWhoseWriterStandsStillInTheMidstOfIt) {
  struct alignas(8) Word {
    std::uint64_t word;
  };
  Published<Word> published;
  published.publish({7});
  EXPECT_EQ(published.read().word, 7u);
  reinterpret_cast<std::atomic<std::uint32_t>&>(published) = 1;  // its version: odd, being written
  EXPECT_EQ(published.read().word, 0u);
}

}  // namespace kphi::netbox::health_test
