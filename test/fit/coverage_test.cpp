#include <gtest/gtest.h>

#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace coverage_test {

// 100 campaigns: a share of 95 % has a deviation of 2.2 %. The tight statement is made by a thousand.
TEST(Coverage, IntervalsOfAHundredCampaignsHoldTheTruth) {
  double share = 0;
  const auto table = coverage_study({}, 100);
  for (const auto& [quantity, coverage] : table) {
    EXPECT_GE(coverage.share(), 88) << quantity;
    EXPECT_LT(std::abs(coverage.bias()), 0.35) << quantity;
    share += coverage.share() / static_cast<double>(table.size());
  }
  EXPECT_GE(share, 92);
  EXPECT_LE(share, 99);
}

TEST(Coverage, OfTheOtherEstimatorsIsNoLess) {
  for (const Estimator estimator : {Estimator::with_offset, Estimator::polynomial, Estimator::at_speed}) {
    double share = 0;
    const auto table = coverage_study({}, 60, estimator);
    for (const auto& [quantity, coverage] : table) share += coverage.share() / static_cast<double>(table.size());
    EXPECT_GE(share, 91) << name_of(estimator);
  }
}

TEST(Coverage, ABentTruthIsReported) {
  const BentCount found = count_bent(bent_truth(), 40);
  EXPECT_GE(found.line, 0.95 * 40);
  EXPECT_GE(found.everywhere, 0.95 * 40);
  EXPECT_EQ(found.speed.size(), 5u);
}

TEST(Coverage, AStraightTruthIsSeldomCalledBent) {
  const BentCount found = count_bent({}, 60);
  EXPECT_LE(found.line_lack_of_fit, 9) << "5 % of 60, and three deviations";
  EXPECT_LE(found.lack_of_fit, 26) << "5 % of 300, and three deviations";
}

}  // namespace coverage_test
}  // namespace kphi::fit
