#include "fit/model/thrust_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "base/error.hpp"
#include "compensation/units.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace thrust_fit_test {

constexpr double kTruth = 1.55e-6;

std::vector<Point> curve(const ThrustParameters<double>& truth, double noise_n, unsigned seed, int n = 40) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 1);
  std::vector<Point> points;
  for (int i = 0; i < n; ++i) {
    const double speed = from_rpm(100 + 19000.0 * i / (n - 1)).value();
    points.push_back({speed, thrust(truth, speed) + noise_n * noise(random), 1});
  }
  return points;
}

TEST(ThrustFit, FindsTheCoefficientOfExactDataToTwelveDigits) {
  for (const double k : {6.4e-8, 1.55e-6, 2.63e-4}) {
    const ThrustFit fit = fit_thrust(curve({k, 0, 0}, 0, 1));
    EXPECT_NEAR(fit.parameters.k / k, 1, 1e-12);
    EXPECT_EQ(fit.parameters.offset, 0);
    EXPECT_EQ(fit.parameters.linear, 0);
  }
}

/// Against the regression that the reference data sets of NIST vouch for.
void expect_regression(const std::vector<Point>& points, ThrustForm form) {
  const bool offset = form == ThrustForm::with_offset;
  std::vector<double> x, y, weights;
  for (const Point& point : points) {
    x.push_back(point.speed_rad_s * point.speed_rad_s);
    y.push_back(point.thrust_n);
    weights.push_back(point.weight);
  }
  const Regression exact = regress_polynomial(x, y, offset ? 0 : 1, 1, weights);
  const ThrustFit fit = fit_thrust(points, {.form = form});
  EXPECT_NEAR(fit.parameters.k / exact.estimates.back(), 1, 1e-11);
  EXPECT_NEAR(fit.standard_error.k / exact.standard_errors.back(), 1, 1e-9);
  EXPECT_NEAR(fit.rms_n / exact.residual_deviation, 1, 1e-9);
  if (!offset) return;
  EXPECT_NEAR(fit.parameters.offset, exact.estimates[0], 1e-10);
  EXPECT_NEAR(fit.standard_error.offset / exact.standard_errors[0], 1, 1e-9);
  EXPECT_NEAR(fit.covariance[0][2] / (exact.covariance[0][1] * std::pow(exact.residual_deviation, 2)), 1, 1e-9);
}

TEST(ThrustFit, AgreesWithTheClosedForm) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> weight(0.2, 5);
  for (unsigned seed = 0; seed < 50; ++seed) {
    expect_regression(curve({kTruth, 0, 0}, 0.05, seed), ThrustForm::through_origin);
    auto points = curve({kTruth, 0, -0.07}, 0.02, seed);
    expect_regression(points, ThrustForm::with_offset);
    for (Point& point : points) point.weight = weight(random);
    expect_regression(points, ThrustForm::with_offset);
  }
}

TEST(ThrustFit, FindsThreeTerms) {
  const ThrustParameters<double> truth{1.3298e-6, 3.836e-5, -0.05};
  const ThrustFit fit = fit_thrust(curve(truth, 0, 1), {.form = ThrustForm::three_terms});
  EXPECT_NEAR(fit.parameters.k / truth.k, 1, 1e-9);
  EXPECT_NEAR(fit.parameters.linear / truth.linear, 1, 1e-8);
  EXPECT_NEAR(fit.parameters.offset / truth.offset, 1, 1e-8);
}

/// In how many of `draws` the fit's k ± `factor` standard errors hold the truth.
template <class Draw>
int covered(unsigned draws, double truth, double factor, const Draw& points, const ThrustFitOptions& options = {}) {
  int within = 0;
  for (unsigned seed = 0; seed < draws; ++seed) {
    const ThrustFit fit = fit_thrust(points(seed), options);
    within += std::abs(fit.parameters.k - truth) <= factor * fit.standard_error.k ? 1 : 0;
  }
  return within;
}

TEST(ThrustFit, StandardErrorCoversTheTruthAsOftenAsItClaims) {
  const int within = covered(1000, kTruth, 1, [](unsigned seed) { return curve({kTruth, 0, 0}, 0.05, seed); });
  EXPECT_GT(within, 640);
  EXPECT_LT(within, 720);
}

TEST(ThrustFit, WeighsLowSpeedsByTheirSquare) {
  auto points = curve({kTruth, 0, 0}, 0, 1);
  points[0].thrust_n += 0.02;  // 100 RPM: T/ω² there is off by a factor of 100
  EXPECT_NEAR(fit_thrust(points).parameters.k / kTruth, 1, 1e-6);
}

TEST(ThrustFit, GivesOneResidualPerPoint) {
  const auto points = curve({kTruth, 0, 0}, 0.1, 3);
  const ThrustFit fit = fit_thrust(points);
  ASSERT_EQ(fit.residuals_n.size(), points.size());
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) sum += fit.residuals_n[i] * std::pow(points[i].speed_rad_s, 2);
  EXPECT_NEAR(sum / 1e8, 0, 1e-6) << "the residuals of a least squares fit are normal to its regressor";
}

TEST(ThrustFit, RefusesWhatItCannotFit) {
  EXPECT_THROW((void)fit_thrust({}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{100, 1, 1}}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{0, 1, 1}, {0, 1, 1}}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{100, std::nan(""), 1}, {200, 1, 1}}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{100, 1, 0}, {200, 1, 1}}), FitError);
  EXPECT_THROW(
      (void)fit_thrust(std::vector<Point>{{100, 1, 1}, {100, 1, 1}, {100, 1, 1}}, {.form = ThrustForm::with_offset}),
      FitError)
      << "one speed cannot tell an offset from a slope";
}

TEST(CoefficientAtASpeed, IsTheMeanOfTheRepetitionsWithItsStandardErrorIfThereAreSome) {
  const std::vector<Point> repetitions{{2000, 6.0, 1}, {2000, 6.2, 1}, {2000, 6.4, 1}};
  const SpeedCoefficient result = k_at_speed(repetitions);
  EXPECT_NEAR(result.k, 6.2 / 4e6, 1e-18);
  EXPECT_NEAR(result.standard_error, 0.2 / 4e6 / std::sqrt(3.0), 1e-18);
  EXPECT_EQ(result.repetitions, 3u);
  EXPECT_TRUE(std::isnan(k_at_speed(std::vector<Point>{{2000, 6.0, 1}}).standard_error));
  EXPECT_THROW((void)k_at_speed({}), FitError);
  EXPECT_THROW((void)k_at_speed(std::vector<Point>{{0, 6.0, 1}}), FitError);
}

TEST(CoefficientAtASpeed, DiffersFromTheFittedOneWhenKRisesWithSpeed) {
  std::vector<Point> points;
  for (double speed = 300; speed <= 2000; speed += 50)
    points.push_back({speed, 1e-6 * (1 + speed / 1e4) * speed * speed, 1});
  const double at_top = k_at_speed(std::vector<Point>{points.back()}).k;
  EXPECT_GT(at_top, fit_thrust(points).parameters.k * 1.01);
}

// ---- with losses and weights ------------------------------------------------------------------------------------

constexpr double kRobustTruth = 1.5e-6;

std::vector<Point> noisy_points(unsigned seed, double noise = 0.02, double speed_noise = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Point> result;
  for (int i = 0; i < 40; ++i) {
    const double speed = 300 + 40.0 * i;
    result.push_back({speed + speed_noise * normal(random), kRobustTruth * speed * speed + noise * normal(random), 1,
                      noise, speed_noise});
  }
  return result;
}

ThrustFitOptions with(Loss loss, Weighting weighting = Weighting::equal) {
  return {.weighting = weighting, .loss = loss};
}

class RobustFit : public ::testing::TestWithParam<Loss> {};

TEST_P(RobustFit, IsNotMovedByGlitchesAndNamesThem) {
  auto data = noisy_points(1);
  data[30].thrust_n *= 4;  // the speed read half of what it was
  data[35].thrust_n = 0;
  const double plain = fit_thrust(data).parameters.k;
  const ThrustFit fit = fit_thrust(data, with(GetParam()));
  EXPECT_GT(std::abs(plain / kRobustTruth - 1), 0.05);
  EXPECT_NEAR(fit.parameters.k / kRobustTruth, 1, 0.01);
  for (std::size_t i = 0; i < data.size(); ++i) {
    EXPECT_NE(fit.robust_weights[i], kRejectedWeight) << i;
    EXPECT_EQ(fit.robust_weights[i] < kRejectedWeight, i == 30 || i == 35) << i;
  }
}

TEST_P(RobustFit, CoversTheTruthAsOftenAsItClaims) {
  const auto points = [](unsigned seed) { return noisy_points(seed); };
  const int within = covered(200, kRobustTruth, 2.02, points, with(GetParam()));
  EXPECT_GE(within, 180);
  EXPECT_LE(within, 198);
}

INSTANTIATE_TEST_SUITE_P(AllLosses, RobustFit, ::testing::Values(Loss::huber, Loss::cauchy, Loss::tukey));

TEST(ThrustFit, WeighsByTheErrorOfTheSpeedToo) {
  auto data = noisy_points(4, 1e-3, 5);  // 5 rad/s at 1900 rad/s are 0.03 N: far above the cell's noise
  const double thrust_only = fit_thrust(data, with(Loss::none, Weighting::thrust)).standard_error.k;
  const ThrustFit both = fit_thrust(data, with(Loss::none, Weighting::effective_variance));
  EXPECT_NEAR(both.parameters.k / kRobustTruth, 1, 0.005);
  EXPECT_LT(both.points.back().weight, both.points.front().weight)
      << "an error of the speed counts where dT/dw is high";
  EXPECT_NE(both.standard_error.k, thrust_only);
  const double slope_ratio = data.back().speed_rad_s / data.front().speed_rad_s;
  EXPECT_NEAR(both.points.front().weight / both.points.back().weight, slope_ratio * slope_ratio, 2);
}

TEST(ThrustFit, ErrorsInSpeedAreCoveredByTheEffectiveVariance) {
  const auto points = [](unsigned seed) { return noisy_points(seed, 2e-3, 5); };
  const int within = covered(200, kRobustTruth, 2.02, points, with(Loss::none, Weighting::effective_variance));
  EXPECT_GE(within, 180);
  EXPECT_LE(within, 198);
}

TEST(ThrustFit, RefusesToWeighByWhatNobodyKnows) {
  auto data = noisy_points(5);
  data[7].u_thrust_n = 0;
  EXPECT_THROW((void)fit_thrust(data, with(Loss::none, Weighting::thrust)), FitError);
}

TEST(ThrustFit, ALossWithoutScatterChangesNothing) {
  const auto data = noisy_points(6, 0);
  EXPECT_NEAR(fit_thrust(data, with(Loss::tukey)).parameters.k / kRobustTruth, 1, 1e-14);
}

}  // namespace thrust_fit_test
}  // namespace kphi::fit
