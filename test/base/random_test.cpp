#include "base/random.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace kphi::random_test {

using testing::ElementsAre;

TEST(Random, NormalHasMeanZeroDeviationOneAndNearlyGaussianShape) {
  Random random(42);
  constexpr int kCount = 1'000'000;
  double sum = 0, square = 0, fourth = 0, beyond_two = 0, largest = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal();
    sum += x;
    square += x * x;
    fourth += x * x * x * x;
    beyond_two += std::abs(x) > 2 ? 1 : 0;
    largest = std::max(largest, std::abs(x));
  }
  EXPECT_NEAR(sum / kCount, 0, 4e-3);
  EXPECT_NEAR(square / kCount, 1, 6e-3);
  EXPECT_NEAR(fourth / kCount, 3 - 0.15, 0.03);
  EXPECT_NEAR(beyond_two / kCount, 0.0455, 2e-3);
  EXPECT_LT(largest, 4.9);
  EXPECT_GT(largest, 4.0);
}

TEST(Random, NeighboursAreUncorrelated) {
  Random random(7);
  constexpr int kCount = 500'000;
  double last = random.normal(), product = 0;
  for (int i = 0; i < kCount; ++i) {
    const double x = random.normal();
    product += x * last;
    last = x;
  }
  EXPECT_NEAR(product / kCount, 0, 6e-3);
}

TEST(Random, SeedsGiveTheSequencesOfThePublishedGenerator) {
  // splitmix64 of seed 0 fills the state; xoshiro256++ then gives this word first.
  constexpr std::uint64_t s0 = 0xe220a8397b1dcdafull, s3 = 0xf88bb8a8724c81ecull;
  const std::uint64_t sum = s0 + s3;
  EXPECT_EQ(Random(0).bits(), ((sum << 23) | (sum >> 41)) + s0);
}

TEST(Random, SymmetricStaysWithinItsBounds) {
  Random random(3);
  double low = 0, high = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double x = random.symmetric();
    low = std::min(low, x);
    high = std::max(high, x);
  }
  EXPECT_GE(low, -1);
  EXPECT_LT(high, 1);
  EXPECT_LT(low, -0.999);
  EXPECT_GT(high, 0.999);
}

TEST(SplitMix64, GivesItsPublishedNumbers) {
  SplitMix64 of_zero(0);
  EXPECT_EQ(of_zero(), 0xE220A8397B1DCDAFu);
  EXPECT_EQ(of_zero(), 0x6E789E6AA1B965F4u);
  EXPECT_EQ(of_zero(), 0x06C45D188009454Fu);
  SplitMix64 of_another(1234567);
  EXPECT_EQ(of_another(), 6457827717110365317u);
  EXPECT_EQ(of_another(), 3203168211198807973u);
}

TEST(Shuffle, GivesTheSameOrderEverywhere) {
  std::vector<int> items{0, 1, 2, 3, 4, 5, 6, 7};
  SplitMix64 draw(7);
  shuffle(items, draw);
  EXPECT_THAT(items, ElementsAre(1, 4, 5, 2, 6, 0, 3, 7)) << "written down once; a machine that differs is wrong";
}

TEST(Shuffle, GivesEachOrderAsOftenAsAnyOther) {
  std::map<std::vector<int>, int> seen;
  SplitMix64 draw(1);
  for (int i = 0; i < 24'000; ++i) {
    std::vector<int> items{1, 2, 3, 4};
    shuffle(items, draw);
    ++seen[items];
  }
  ASSERT_EQ(seen.size(), 24u);
  double chi_squared = 0;
  for (const auto& [order, n] : seen) chi_squared += (n - 1000.0) * (n - 1000.0) / 1000;
  EXPECT_LT(chi_squared, 49.7) << "99.9 % of chi² with 23 degrees of freedom";
}

TEST(Shuffle, BearsNothingAndOne) {
  SplitMix64 draw(1);
  std::vector<int> none, one{5};
  shuffle(none, draw);
  shuffle(one, draw);
  EXPECT_TRUE(none.empty());
  EXPECT_THAT(one, ElementsAre(5));
}

}  // namespace kphi::random_test
