#include "drivers/netbox/receive/range_watch.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace kphi::netbox {
namespace {

class RangeWatchTest : public testing::Test {
 protected:
  static Configuration cell() {
    Configuration configuration;
    configuration.counts_per_newton = configuration.counts_per_newton_metre = 1e6;
    configuration.range = {20, 20, 60, 1, 1, 1};
    return configuration;
  }
  RangeVerdict look(int axis, std::int32_t counts) {
    Record record;
    record.counts[static_cast<std::size_t>(axis)] = counts;
    return watch.look(record);
  }
  RangeWatch watch{cell()};
};

TEST_F(RangeWatchTest, JudgesAtItsLimitsOnBothSides) {
  for (const int sign : {1, -1}) {
    EXPECT_EQ(look(2, sign * 48'000'000), RangeVerdict::inside);
    EXPECT_EQ(look(2, sign * 48'000'001), RangeVerdict::near);
    EXPECT_EQ(look(2, sign * 59'999'999), RangeVerdict::near);
    EXPECT_EQ(look(2, sign * 60'000'000), RangeVerdict::beyond);
    EXPECT_EQ(look(2, sign * 66'000'001), RangeVerdict::trip);
  }
  EXPECT_EQ(watch.count(RangeVerdict::inside), 2u);
  EXPECT_EQ(watch.count(RangeVerdict::near), 4u);
  EXPECT_EQ(watch.count(RangeVerdict::beyond), 2u);
  EXPECT_EQ(watch.count(RangeVerdict::trip), 2u);
}

TEST_F(RangeWatchTest, EachAxisHasItsOwnRange) {
  for (const int axis : {0, 1}) EXPECT_EQ(look(axis, 20'000'000), RangeVerdict::beyond);
  for (const int axis : {3, 4, 5}) EXPECT_EQ(look(axis, 1'000'000), RangeVerdict::beyond);
}

TEST_F(RangeWatchTest, KeepsTheWorstAndItsAxis) {
  look(2, 10'000'000);
  look(5, -900'000);
  look(2, 50'000'000);
  EXPECT_EQ(watch.worst(), RangeVerdict::near);
  EXPECT_EQ(watch.worst_axis(), 5);
  EXPECT_DOUBLE_EQ(watch.largest_load(), 0.9);
  watch.reset();
  EXPECT_EQ(watch.worst(), RangeVerdict::inside);
  EXPECT_EQ(watch.count(RangeVerdict::near), 0u);
}

TEST_F(RangeWatchTest, TheLeastNumberOfAllIsATripToo) {
  EXPECT_EQ(look(0, std::numeric_limits<std::int32_t>::min()), RangeVerdict::trip);
}

TEST(RangeWatchOfPounds, UsesTheRangeInSi) {
  Configuration configuration;
  configuration.counts_per_newton = configuration.counts_per_newton_metre = 1 / 4.4482216152605;  // one count per lbf
  configuration.range = {44, 44, 44, 44, 44, 44};
  RangeWatch watch(configuration);
  Record record;
  record.counts[0] = 9;  // 40 N
  EXPECT_EQ(watch.look(record), RangeVerdict::near);
}

}  // namespace
}  // namespace kphi::netbox
