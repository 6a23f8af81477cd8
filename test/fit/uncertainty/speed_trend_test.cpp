#include "fit/uncertainty/speed_trend.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "compensation/compensator.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace speed_trend_test {

Analysis analysis_of(const StudyTruth& truth, unsigned seed, const IdentificationOptions& options = {}) {
  return analyse(identify(study_campaign(truth, seed).steps, options));
}

TEST(SpeedTrend, IsFoundInEveryCampaignThatHasOneAndSeldomInOthers) {
  int missed = 0, invented = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    missed += analysis_of({.rise = 0.1}, seed).trend ? 0 : 1;
    invented += analysis_of({}, seed).trend ? 1 : 0;
  }
  EXPECT_EQ(missed, 0);
  EXPECT_LE(invented, 6) << "one in twenty";
}

TEST(SpeedTrend, IsWhatWasPutIntoTheStepsWithinItsUncertainty) {
  const double range = from_rpm(19100).value();
  double within = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const auto trend = analysis_of({.rise = 0.15}, seed).trend;
    ASSERT_TRUE(trend);
    // k (1 + rise (ω/range − 1/2)), as a share of the k of the reference
    const double expected = 0.15 / range / (1 + 0.15 * (trend->reference_rad_s / range - 0.5));
    within += std::abs(trend->per_rad_s.value - expected) < 2 * trend->per_rad_s.u ? 1 : 0;
    EXPECT_NEAR(trend->reference_rad_s / range, 0.83, 0.02);
  }
  EXPECT_GE(within, 34) << "of 40";
}

TEST(SpeedTrend, NeedsAKOfOneSpeed) {
  EXPECT_FALSE(analysis_of({.rise = 0.1}, 1, {.estimator = Estimator::with_offset}).trend);
  EXPECT_FALSE(analysis_of({.rise = 0.1}, 1, {.weighting = Weighting::thrust}).trend);
  const auto at_speed = analysis_of({.rise = 0.1}, 1, {.estimator = Estimator::at_speed}).trend;
  ASSERT_TRUE(at_speed);
  EXPECT_NEAR(to_rpm(RadPerSec(at_speed->reference_rad_s)), 19100, 1);
}

/// The largest error of the thrust that the fitted curve promises, from 4000 to 19000 RPM, as a share.
double worst_error(const compensation::ThrustCurve& curve, const StudyTruth& truth, double density) {
  double worst = 0;
  for (const double phi : {0.0, 45.0, 90.0, 180.0, 270.0}) {
    for (double rpm = 4000; rpm <= 19'000; rpm += 1000) {
      const double speed = from_rpm(rpm).value(), share = rpm / 19100;
      const double k = truth.k(phi) * density / kStandardDensity * (1 + truth.rise * (share - 0.5));
      const double promised = curve.thrust_coefficient().value() * curve.scaling_factor(from_degrees(phi)) *
                              curve.speed_trend().factor_at(speed);
      worst = std::max(worst, std::abs(promised / k - 1));
    }
  }
  return worst;
}

TEST(WhatTheBenchKnows, IsFlownWithATableAndATrend) {
  const StudyTruth truth{.bend = 0.2, .rise = 0.15, .between_runs = 0.001, .calibration = 1e-4};
  const StudyCampaign campaign = study_campaign(truth, 3);
  const auto curve_of = [&](CurveForm form) {
    const Fitted fitted = analysed(identify(campaign.steps, {.curve = {.form = form}}));
    return compensation::parse_coefficients(format_coefficients(fitted, {}), "c.yaml").curve;
  };
  const compensation::ThrustCurve table = curve_of(CurveForm::table), line = curve_of(CurveForm::line);
  compensation::ThrustCurve without_trend = table;
  ASSERT_TRUE(without_trend.set_speed_trend({0, RadPerSec(1)}));
  EXPECT_LT(worst_error(table, truth, campaign.density), 0.015);
  EXPECT_GT(worst_error(without_trend, truth, campaign.density), 0.08) << "k at 4000 RPM is 9 % lower";
  EXPECT_GT(worst_error(line, truth, campaign.density), 0.05) << "the line misses the bend";
}

}  // namespace speed_trend_test
}  // namespace kphi::fit
