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
  bent.rise = 0.10;
  int line = 0, speed = 0;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    const StudyCampaign campaign = study_campaign(bent, seed);
    const Analysis analysis = analyse(identify(campaign.steps), study_options(bent, campaign));
    line += analysis.curvature.bends() ? 1 : 0;
    int found = 0;
    for (const SpeedDependence& one : analysis.speed) found += one.lack_of_fit.rejected() ? 1 : 0;
    speed += found == 5 ? 1 : 0;
  }
  fmt::print("bend found in {}, rise found at every angle in {} of 1000\n", line, speed);
  EXPECT_GE(line, 950);
  EXPECT_GE(speed, 950);
}

}  // namespace
}  // namespace kphi::fit
