#include <gtest/gtest.h>

#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace {

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
  StudyTruth bent;
  bent.bend = 0.03;
  bent.rise = 0.15;  // real ones of 5 inch rise by 11 to 21 %
  int line = 0, speed = 0, draws = 40;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const StudyCampaign campaign = study_campaign(bent, seed);
    const Analysis analysis = analyse(identify(campaign.steps), study_options(bent, campaign));
    line += analysis.curvature.bends() ? 1 : 0;
    int found = 0;
    for (const SpeedDependence& one : analysis.speed) found += one.depends() ? 1 : 0;
    speed += found == 5 ? 1 : 0;
  }
  EXPECT_GE(line, 0.95 * draws);
  EXPECT_GE(speed, 0.95 * draws);
}

TEST(Coverage, AStraightTruthIsSeldomCalledBent) {
  int line = 0, speed = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const StudyCampaign campaign = study_campaign({}, seed);
    const Analysis analysis = analyse(identify(campaign.steps), study_options({}, campaign));
    line += analysis.curvature.lack_of_fit.rejected() ? 1 : 0;
    for (const SpeedDependence& one : analysis.speed) speed += one.lack_of_fit.rejected() ? 1 : 0;
  }
  EXPECT_LE(line, 9) << "5 % of 60, and three deviations";
  EXPECT_LE(speed, 26) << "5 % of 300, and three deviations";
}

}  // namespace
}  // namespace kphi::fit
