// The statement about intervals, by a thousand campaigns.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace {

TEST(ThousandCampaigns, IntervalsCoverTheTruthAsOftenAsTheySay) {
  for (const auto& [quantity, coverage] : coverage_study({}, 1000)) {
    fmt::print("{:<28} {:5.1f} %, bias {:+.3f} u\n", quantity, coverage.share(), coverage.bias());
    EXPECT_GE(coverage.share(), 93) << quantity;
    EXPECT_LE(coverage.share(), 97) << quantity;
    EXPECT_LT(std::abs(coverage.bias()), 0.2) << quantity;
  }
}

TEST(ThousandCampaigns, ABentTruthIsReported) {
  StudyTruth bent;
  bent.bend = 0.03;
  bent.rise = 0.15;  // real ones of 5 inch rise by 11 to 21 %
  int line = 0;
  std::map<double, int> speed;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    const StudyCampaign campaign = study_campaign(bent, seed);
    const Analysis analysis = analyse(identify(campaign.steps), study_options(bent, campaign));
    line += analysis.curvature.bends() ? 1 : 0;
    for (const SpeedDependence& one : analysis.speed) speed[one.phi_deg] += one.depends() ? 1 : 0;
  }
  fmt::print("bend found in {} of 1000\n", line);
  EXPECT_GE(line, 950);
  for (const auto& [phi_deg, found] : speed) {
    fmt::print("rise at {:3} deg found in {}\n", phi_deg, found);
    EXPECT_GE(found, 950) << phi_deg;
  }
}

TEST(ThousandCampaigns, AStraightTruthIsCalledBentInOneOfTwenty) {
  int lack = 0, trend = 0, line = 0;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    const StudyCampaign campaign = study_campaign({}, seed);
    const Analysis analysis = analyse(identify(campaign.steps), study_options({}, campaign));
    line += analysis.curvature.lack_of_fit.rejected() ? 1 : 0;
    for (const SpeedDependence& one : analysis.speed) {
      lack += one.lack_of_fit.rejected() ? 1 : 0;
      trend += one.trend.rejected() ? 1 : 0;
    }
  }
  fmt::print("called bent: line {:.1f} %, lack of fit {:.1f} %, trend {:.1f} %\n", 0.1 * line, 0.02 * lack,
             0.02 * trend);
  for (const double percent : {0.1 * line, 0.02 * lack, 0.02 * trend}) {
    EXPECT_GE(percent, 3);
    EXPECT_LE(percent, 7);
  }
}

}  // namespace
}  // namespace kphi::fit
