#include "compensation/flight/random.hpp"

#include <gtest/gtest.h>

namespace kphi::flight {
namespace {

TEST(Random, IsSplitMix64) {
  Random random(1234567);
  EXPECT_EQ(random.bits(), 6457827717110365317u);
  EXPECT_EQ(random.bits(), 3203168211198807973u);
}

TEST(Random, HasTheMomentsOfItsDistributions) {
  Random random(5);
  const int count = 200000;
  double sum = 0, squares = 0, fourth = 0, flat = 0;
  for (int i = 0; i < count; ++i) {
    const double z = random.normal(0, 1), u = random.uniform(2, 4);
    ASSERT_TRUE(u >= 2 && u < 4);
    sum += z;
    squares += z * z;
    fourth += z * z * z * z;
    flat += u;
  }
  EXPECT_NEAR(sum / count, 0, 0.01);
  EXPECT_NEAR(squares / count, 1, 0.015);
  EXPECT_NEAR(fourth / count, 3, 0.1);
  EXPECT_NEAR(flat / count, 3, 0.01);
}

TEST(Random, StreamsOfOneSeedDiffer) {
  EXPECT_NE(Random(1, 0).bits(), Random(1, 1).bits());
  EXPECT_NE(Random(1, 0).bits(), Random(2, 0).bits());
  EXPECT_EQ(Random(7, 3).bits(), Random(7, 3).bits());
}

}  // namespace
}  // namespace kphi::flight
