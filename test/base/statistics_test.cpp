#include "base/statistics.hpp"

#include <gtest/gtest.h>

#include <array>

namespace kphi::statistics_test {

TEST(Statistics, MeanAndVariance) {
  const std::array<double, 4> values{1, 2, 3, 6};
  EXPECT_DOUBLE_EQ(mean(values), 3);
  EXPECT_DOUBLE_EQ(variance(values), 14.0 / 3);
  EXPECT_TRUE(std::isnan(variance(std::span(values).first(1))));
  EXPECT_TRUE(std::isnan(mean({})));
}

TEST(Statistics, MediansDifferOnlyForAnEvenNumber) {
  EXPECT_EQ(median({9, 1, 3}), 3);
  EXPECT_EQ(upper_median({9, 1, 3}), 3);
  EXPECT_EQ(median({9, 1, 3, 5}), 4);
  EXPECT_EQ(upper_median({9, 1, 3, 5}), 5);
  EXPECT_EQ(median({7}), 7);
}

}  // namespace kphi::statistics_test
