#include "profiles/shuffle.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

namespace kphi::profiles {
namespace {

using testing::ElementsAre;

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

}  // namespace
}  // namespace kphi::profiles
