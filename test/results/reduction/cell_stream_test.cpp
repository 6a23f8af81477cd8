#include "results/reduction/cell_stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "test/results/synthetic_run.hpp"

namespace kphi::results::cell_stream_test {

using namespace test;

struct Stream : LoadCellColumns, CellStream {
  explicit Stream(const RunRecording& run) : LoadCellColumns(run.load_cell, run.header), CellStream(run, *this) {}
};

constexpr Window kSecond{2'000'000'000, 3'000'000'000};

TEST(CellBins, HoldEverySampleOnceHoweverTheyAreCut) {
  const auto run = make_run(Truth{});
  const Stream cell(run);
  const CellBins bins = cell.bins(kSecond);
  ASSERT_EQ(bins.size(), 100u);
  const CellWindow whole = bins.over(0, 100);
  const CellWindow left = bins.over(0, 37), right = bins.over(37, 100);
  EXPECT_EQ(left.n + right.n, whole.n);
  EXPECT_NEAR(static_cast<double>(whole.n), 1000, 2);
  const double joined =
      (static_cast<double>(left.n) * left.force.mean + static_cast<double>(right.n) * right.force.mean) /
      static_cast<double>(whole.n);
  EXPECT_NEAR(joined, whole.force.mean, 1e-6 * std::abs(whole.force.mean));
}

/// The sums are taken in narrow numbers where they fit; the wide ones are the definition.
TEST(CountSums, AreExactForCountsOfAnySize) {
  std::mt19937 dice(5);
  for (const std::int32_t bound :
       {1, 1 << 20, (1 << 24) - 1, 1 << 24, 1 << 30, std::numeric_limits<std::int32_t>::max()}) {
    for (const std::size_t n : {0u, 1u, 70u, 127u, 128u, 129u, 1000u}) {
      std::uniform_int_distribution<std::int32_t> count(-bound - (bound > 1 << 30), bound);
      const std::int32_t origin = count(dice);
      std::vector<std::int32_t> counts(n);
      std::ranges::generate(counts, [&] { return count(dice); });
      CountSums sums;
      sums.add(counts, origin);
      std::int64_t sum = 0;
      Wide squares = 0;
      for (const std::int64_t each : counts) {
        sum += each - origin;
        squares += static_cast<Wide>(each - origin) * (each - origin);
      }
      EXPECT_EQ(sums.sum, sum) << bound << ", " << n;
      EXPECT_TRUE(sums.squares == squares) << bound << ", " << n;
    }
  }
  CountSums ends;
  ends.add(std::vector{std::numeric_limits<std::int32_t>::max()}, std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(ends.sum, 4294967295) << "a difference that 32 bits would take for -1";
}

TEST(CellBins, ComeToTheSameBitsFromAnotherBeginning) {
  const auto run = make_run(Truth{});
  const Stream cell(run);
  const CellWindow late = cell.bins(kSecond).over(50, 100);
  const CellWindow alone = cell.bins({2'500'000'000, 3'000'000'000}).over(0, 50);
  EXPECT_EQ(late.n, alone.n);
  EXPECT_EQ(late.force.deviation, alone.force.deviation) << "integer sums do not care where they are counted from";
}

TEST(CellBins, AreExactAtTheLargestCounts) {
  auto run = make_run(Truth{});
  bool high = false;
  for (auto& record : run.load_cell) record.counts[2] = (high = !high) ? 2'147'483'647 : -2'147'483'647 - 1;
  const Stream cell(run);
  const CellBins bins = cell.bins(kSecond);
  const CellWindow all = bins.over(0, bins.size());
  EXPECT_NEAR(all.force.mean, -0.5, 5e6);
  EXPECT_NEAR(all.force.deviation, 2147483647.5, 2e6);
  EXPECT_TRUE(all.at_limit);
}

TEST(CellBins, NoticeAThrustThatRepeatsOneValueWhileTheOtherAxesGoOn) {
  auto run = make_run(Truth{});
  for (std::size_t i = 2500; i < 2640; ++i) run.load_cell[i].counts[2] = run.load_cell[2500].counts[2];
  EXPECT_TRUE(Stream(run).bins(kSecond).over(0, 100).frozen);
}

TEST(CellBins, NoticeACellThatRepeatsOneValue) {
  auto run = make_run(Truth{});
  const auto freeze = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) run.load_cell[i].counts = run.load_cell[begin].counts;
  };
  freeze(2300, 2380);
  EXPECT_FALSE(Stream(run).bins(kSecond).over(0, 100).frozen) << "less than a tenth of a second";
  freeze(2500, 2640);
  EXPECT_TRUE(Stream(run).bins(kSecond).over(0, 100).frozen);
  EXPECT_FALSE(Stream(run).bins(kSecond).over(0, 50).frozen);
}

TEST(CellBins, AreWiderWhereSamplesAreRare) {
  Truth truth;
  truth.rate_hz = 26;
  truth.ft_stride = 1;
  const auto run = make_run(truth);
  const CellBins bins = Stream(run).bins(kSecond);
  EXPECT_NEAR(bins.bin_s(), 2.0 / 26, 1e-6);
  for (std::size_t i = 0; i < bins.size(); ++i) EXPECT_FALSE(std::isnan(bins.force(i)));
}

TEST(CellBins, TellWhatWasLostToTheSample) {
  Truth truth;
  truth.lose = [](std::uint64_t n) { return (n >= 2495 && n < 2505) || (n >= 2998 && n < 3010); };
  const auto run = make_run(truth);
  const CellBins bins = Stream(run).bins(kSecond);
  EXPECT_EQ(bins.over(0, 50).lost, 5u);
  EXPECT_EQ(bins.over(0, 99).lost, 10u);
  EXPECT_EQ(bins.over(50, 100).lost, 7u) << "two of those that were lost across the end";
  EXPECT_EQ(bins.over(60, 99).lost, 0u);
}

TEST(CellStream, GivesEvenSamplesWithGapsFilledAndNoneAcrossARestart) {
  Truth truth;
  truth.lose = [](std::uint64_t n) { return n >= 2500 && n < 2510; };
  RunRecording run = make_run(truth);
  const EvenSamples even = Stream(run).samples(kSecond);
  EXPECT_DOUBLE_EQ(even.rate_hz, truth.rate_hz);
  ASSERT_NEAR(static_cast<double>(even.counts.size()), 1000, 1);
  std::size_t held = 0;
  for (std::size_t i = 1; i < even.counts.size(); ++i) held += even.counts[i] == even.counts[i - 1];
  EXPECT_EQ(held, 10u);
  for (auto& record : run.load_cell)
    if (record.arrival_ns > 2'300'000'000) record.ft_sequence -= 500000;
  EXPECT_TRUE(Stream(run).samples(kSecond).counts.empty()) << "the box restarted at 2.3 s";
}

}  // namespace kphi::results::cell_stream_test
