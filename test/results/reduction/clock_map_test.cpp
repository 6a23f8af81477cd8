#include "results/reduction/clock_map.hpp"

#include <gtest/gtest.h>

#include "test/results/synthetic_run.hpp"

namespace kphi::results::clock_map_test {
using namespace test;

struct Map : LoadCellColumns, ClockMap {
  Map(const std::vector<LoadCellRecord>& records, double rate_hz, std::span<const StreamEvent> events = {})
      : LoadCellColumns(records), ClockMap(static_cast<const LoadCellColumns&>(*this), rate_hz, events) {}
};

Truth stream_of(double skew_ppm, int records_per_datagram, double jitter_us) {
  Truth truth;
  truth.rate_hz = 7000;
  truth.ft_stride = 1;
  truth.skew_ppm = skew_ppm;
  truth.records_per_datagram = records_per_datagram;
  truth.jitter_us = jitter_us;
  truth.speeds.assign(20, 500);
  return truth;
}

/// Largest distance to the true sample time plus the smallest delay, which nobody can see; in µs.
double worst_error_us(const Truth& truth, const std::vector<LoadCellRecord>& records, const ClockMap& map) {
  double worst = 0;
  for (const ClockEpoch& epoch : map.epochs()) {
    for (std::size_t i = epoch.begin; i < epoch.end; ++i) {
      const double n = static_cast<double>(records[i].ft_sequence - truth.ft_begin) / truth.ft_stride;
      const double sampled_ns = 1e9 * n * (1 + 1e-6 * truth.skew_ppm) / truth.rate_hz;
      const double error = static_cast<double>(map.time_ns(epoch, i)) - sampled_ns - 1e3 * truth.delay_us;
      worst = std::max(worst, std::abs(error));
    }
  }
  return 1e-3 * worst;
}

/// 99 % of the last records of datagrams came less than this after the line, µs.
double lateness_p99_us(const std::vector<LoadCellRecord>& records, const ClockMap& map) {
  std::vector<double> late;
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (i + 1 < records.size() && records[i + 1].arrival_ns == records[i].arrival_ns) continue;
    late.push_back(1e-3 * static_cast<double>(records[i].arrival_ns - map.time_ns(map.epochs()[0], i)));
  }
  std::sort(late.begin(), late.end());
  return late[static_cast<std::size_t>(0.99 * static_cast<double>(late.size() - 1))];
}

TEST(ClockMap, FindsASkewedJitteredDeviceClockWithinATenthOfAMillisecond) {
  for (const double skew : {-60.0, 0.0, 60.0}) {
    for (const int records : {1, 40}) {
      for (const double jitter : {30.0, 200.0}) {
        const Truth truth = stream_of(skew, records, jitter);
        const auto run = make_run(truth);
        const Map map(run.load_cell, 7000);
        ASSERT_EQ(map.epochs().size(), 1u);
        EXPECT_LT(worst_error_us(truth, run.load_cell, map), 100) << skew << " ppm, " << records << " records";
        EXPECT_NEAR(1e6 * map.epochs()[0].skew, skew, 2);
        EXPECT_NEAR(lateness_p99_us(run.load_cell, map), jitter * std::log(100), 0.5 * jitter * std::log(100));
      }
    }
  }
}

TEST(ClockMap, BeatsTheArrivalStampsOfBufferedRecords) {
  Truth truth = stream_of(30, 40, 30);
  const auto run = make_run(truth);
  const Map map(run.load_cell, 7000);
  // The first record of a datagram waited 39 periods for its stamp: 5.6 ms.
  const double waited = 1e-3 * static_cast<double>(run.load_cell[0].arrival_ns - map.time_ns(map.epochs()[0], 0));
  EXPECT_GT(waited, 5000);
  EXPECT_LT(worst_error_us(truth, run.load_cell, map), 100);
  truth.rate_hz = 50;
  const auto slow = make_run(truth);
  EXPECT_LT(worst_error_us(truth, slow.load_cell, ClockMap(slow.load_cell, 50)), 100) << "0.8 s a datagram";
}

TEST(ClockMap, IsNotMovedByLateDatagramsOrGaps) {
  Truth truth = stream_of(60, 1, 30);
  truth.lose = [](std::uint64_t n) { return (n > 70000 && n < 90000) || n % 97 == 3; };
  auto run = make_run(truth);
  for (std::size_t i = 0; i < run.load_cell.size(); i += 500) run.load_cell[i].arrival_ns += 20000000;
  const Map map(run.load_cell, 7000);
  EXPECT_LT(worst_error_us(truth, run.load_cell, map), 100);
}

TEST(ClockMap, GoesThroughTheWrapOfTheCounter) {
  Truth truth = stream_of(0, 1, 30);
  truth.ft_begin = 4294967295u - 1000;
  const auto run = make_run(truth);
  const Map map(run.load_cell, 7000);
  EXPECT_EQ(map.epochs().size(), 1u);
  EXPECT_LT(worst_error_us(truth, run.load_cell, map), 100);
}

TEST(ClockMap, ARestartedBoxIsANewClock) {
  Truth truth = stream_of(0, 1, 30);
  truth.ft_begin = 1000000;
  auto run = make_run(truth);
  const std::size_t half = run.load_cell.size() / 2;
  for (std::size_t i = half; i < run.load_cell.size(); ++i)
    run.load_cell[i].ft_sequence = static_cast<std::uint32_t>(i - half);
  const Map map(run.load_cell, 7000);
  ASSERT_EQ(map.epochs().size(), 2u);
  const ClockEpoch& second = map.epochs()[1];
  EXPECT_EQ(second.begin, half);
  const double true_ns = 1e9 * static_cast<double>(half) / 7000 + 80000;
  EXPECT_NEAR(static_cast<double>(map.time_ns(second, half)), true_ns, 100000);
}

TEST(ClockMap, AWrongRateIsNotPlausible) {
  const auto run = make_run(stream_of(0, 1, 30));
  const Map map(run.load_cell, 7010);
  EXPECT_FALSE(std::abs(map.epochs()[0].skew) < 500e-6);
}

TEST(ClockMap, FindsTheFirstSampleAtATime) {
  const auto run = make_run(stream_of(10, 40, 30));
  const Map map(run.load_cell, 7000);
  const ClockEpoch& epoch = map.epochs()[0];
  for (const std::size_t i : {std::size_t{1}, std::size_t{777}, run.load_cell.size() - 1}) {
    EXPECT_EQ(map.first_at(epoch, map.time_ns(epoch, i)), i);
    EXPECT_EQ(map.first_at(epoch, map.time_ns(epoch, i) - 1), i);
  }
  EXPECT_EQ(map.first_at(epoch, 1000000000000000), epoch.end);
  EXPECT_EQ(map.first_at(epoch, -1000000000), epoch.begin);
}

TEST(ClockMap, LivesWithAlmostNothing) {
  EXPECT_TRUE(ClockMap({}, 7000).epochs().empty());
  const std::vector<LoadCellRecord> one(1);
  const Map map(one, 7000);
  ASSERT_EQ(map.epochs().size(), 1u);
  EXPECT_EQ(map.time_ns(map.epochs()[0], 0), 0);
  std::vector<LoadCellRecord> brief(1400);
  for (std::uint32_t i = 0; i < brief.size(); ++i) brief[i].ft_sequence = 7 * i, brief[i].arrival_ns = 1'001'000 * i;
  EXPECT_EQ(ClockMap(brief, 7000).epochs()[0].skew, 0) << "three half seconds";
}

/// One record each millisecond; the box stands still for a second after the 2000th.
TEST(ClockMap, BeginsAnewWhereTheBoxTookUpCountingAgain) {
  std::vector<LoadCellRecord> records(6000);
  for (std::size_t i = 0; i < records.size(); ++i) {
    records[i].ft_sequence = static_cast<std::uint32_t>(7 * i);
    records[i].arrival_ns = static_cast<Nanoseconds>(1'000'000 * i + (i < 2000 ? 0 : 1'000'000'000));
  }
  const std::vector<StreamEvent> events{{EventKind::stall_ended, 3'000'000'000, 0, ""}};
  const Map map(records, 7000, events);
  ASSERT_EQ(map.epochs().size(), 2u);
  EXPECT_FALSE(map.epochs()[1].rebooted);
  EXPECT_EQ(map.epochs()[1].begin, 2000u);
  EXPECT_NEAR(static_cast<double>(map.time_ns(map.epochs()[1], 4000)), 5e9, 1e3);
  EXPECT_NEAR(1e6 * map.epochs()[0].skew, 0, 1);

  const Map unaware(records, 7000);
  EXPECT_FALSE(std::abs(unaware.epochs()[0].skew) < 500e-6) << "without the break the clock seems far off";
}

TEST(SampleTimes, AreStrictlyIncreasingAndTheSamplesOwn) {
  const Truth truth = stream_of(40, 40, 20);
  RunRecording run = make_run(truth);
  run.header.load_cell.device_rate_hz = 7000;
  const std::vector<Nanoseconds> times = sample_times(run);
  ASSERT_EQ(times.size(), run.load_cell.size());
  double worst = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double n = static_cast<double>(run.load_cell[i].ft_sequence - truth.ft_begin);
    const double sampled_ns = 1e9 * n * (1 + 1e-6 * truth.skew_ppm) / truth.rate_hz;
    worst = std::max(worst, std::abs(static_cast<double>(times[i]) - sampled_ns - 1e3 * truth.delay_us));
    ASSERT_TRUE(i == 0 || times[i] > times[i - 1]) << i;
  }
  EXPECT_LT(worst, 10e3) << "ns, beside the smallest delay of the wire";
}

TEST(SampleTimes, AreNeverLaterThanTheArrival) {
  for (const int records : {1, 7, 40}) {
    RunRecording run = make_run(stream_of(25, records, 200));
    run.header.load_cell.device_rate_hz = 7000;
    const std::vector<Nanoseconds> times = sample_times(run);
    ASSERT_EQ(times.size(), run.load_cell.size());
    std::size_t line_is_later = 0;
    const Map map(run.load_cell, 7000);
    for (std::size_t i = 0; i < times.size(); ++i) {
      ASSERT_LE(times[i], run.load_cell[i].arrival_ns) << i;
      ASSERT_TRUE(i == 0 || times[i] > times[i - 1]) << i;
      ASSERT_NEAR(static_cast<double>(times[i]), static_cast<double>(map.time_ns(map.epochs()[0], i)), 50e3) << i;
      line_is_later += map.time_ns(map.epochs()[0], i) > run.load_cell[i].arrival_ns ? 1 : 0;
    }
    EXPECT_GT(line_is_later, 0u) << "or the test shows nothing";
  }
}

TEST(SampleTimes, OfAStampThatSteppedStayOnTheLine) {
  RunRecording run = make_run(stream_of(0, 1, 30));
  run.header.load_cell.device_rate_hz = 7000;
  const std::vector<Nanoseconds> before = sample_times(run);
  for (std::size_t i = 7000; i < 7010; ++i) run.load_cell[i].arrival_ns -= 3'000'000'000;
  const std::vector<Nanoseconds> after = sample_times(run);
  for (std::size_t i = 0; i < after.size(); ++i)
    ASSERT_NEAR(static_cast<double>(after[i]), static_cast<double>(before[i]), 50e3) << i;
}

TEST(SampleTimes, WithoutARateAreTheArrivals) {
  RunRecording run = make_run(stream_of(0, 40, 20));
  run.header.load_cell.device_rate_hz = 0;
  const std::vector<Nanoseconds> times = sample_times(run);
  EXPECT_EQ(times.at(39), run.load_cell.front().arrival_ns) << "of a datagram the last, the others just before it";
  for (std::size_t i = 1; i < times.size(); ++i) ASSERT_GT(times[i], times[i - 1]);
}

}  // namespace kphi::results::clock_map_test
