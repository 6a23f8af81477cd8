#include "base/histogram.hpp"

#include <gtest/gtest.h>

namespace kphi::histogram_test {

using namespace std::chrono_literals;

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
}

}  // namespace kphi::histogram_test
