#include "drivers/netbox/receive/load.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace kphi::netbox::load_test {

TEST(ZeroEstimate, IsMeanAndSpreadInNewtonsAndNewtonMetresWithoutSaturatedAndFaultyRecords) {
  Configuration scale;
  scale.counts_per_newton = 1e6;
  scale.counts_per_newton_metre = 1e3;
  ZeroEstimate estimate;
  for (const std::int32_t i : {1, 2, 3}) estimate.add({0, 0, 1'000'000 * i, 0, 0, -1000 * i}, 0);
  estimate.add({0, 0, 1'000'000'000, 0, 0, 0}, 0x80020000u);
  estimate.add({0, 0, 4'000'000, 0, 0, -4000}, 0x80010000u);  // a latched monitor condition is healthy
  const ZeroMeasurement zero = estimate.result(scale);
  EXPECT_DOUBLE_EQ(zero.mean[2], 2.5);
  EXPECT_DOUBLE_EQ(zero.mean[5], -2.5);
  EXPECT_DOUBLE_EQ(zero.standard_deviation[2], std::sqrt(5.0 / 3.0));
  EXPECT_DOUBLE_EQ(zero.standard_deviation[5], std::sqrt(5.0 / 3.0));
  EXPECT_EQ(zero.mean[0], 0);
  EXPECT_EQ(zero.records, 4u);
}

class RangeWatchTest : public testing::Test {
 protected:
  static Configuration cell() {
    Configuration configuration;
    configuration.counts_per_newton = configuration.counts_per_newton_metre = 1e6;
    configuration.range = {20, 20, 60, 1, 1, 1};
    return configuration;
  }
  RangeVerdict look(std::size_t axis, std::int32_t counts) {
    Counts all{};
    all[axis] = counts;
    return watch.look(all);
  }
  RangeWatch watch{cell()};
};

TEST_F(RangeWatchTest, JudgesEachAxisAtItsLimitsOnBothSides) {
  for (const int sign : {1, -1}) {
    EXPECT_EQ(look(2, sign * 48'000'000), RangeVerdict::inside);
    EXPECT_EQ(look(2, sign * 48'000'001), RangeVerdict::near);
    EXPECT_EQ(look(2, sign * 59'999'999), RangeVerdict::near);
    EXPECT_EQ(look(2, sign * 60'000'000), RangeVerdict::beyond);
  }
  for (const std::size_t axis : {0, 1}) EXPECT_EQ(look(axis, 20'000'000), RangeVerdict::beyond);
  for (const std::size_t axis : {3, 4, 5}) EXPECT_EQ(look(axis, 1'000'000), RangeVerdict::beyond);
  EXPECT_EQ(look(0, std::numeric_limits<std::int32_t>::min()), RangeVerdict::beyond);
}

TEST_F(RangeWatchTest, KeepsTheLargestLoadAndItsAxis) {
  look(2, 10'000'000);
  look(5, -900'000);
  look(2, 50'000'000);
  EXPECT_EQ(watch.worst_axis(), 5);
  EXPECT_DOUBLE_EQ(watch.largest_load(), 0.9);
}

TEST(RangeWatchOfPounds, UsesTheRangeInSi) {
  Configuration configuration;
  configuration.counts_per_newton = configuration.counts_per_newton_metre = 1 / 4.4482216152605;  // one count per lbf
  configuration.range = {44, 44, 44, 44, 44, 44};
  EXPECT_EQ(RangeWatch(configuration).look({9, 0, 0, 0, 0, 0}), RangeVerdict::near);  // 40 N
}

}  // namespace kphi::netbox::load_test
