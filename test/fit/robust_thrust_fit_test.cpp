#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "base/error.hpp"
#include "fit/model/thrust_fit.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

constexpr double kTruth = 1.5e-6;

std::vector<Point> points(unsigned seed, double noise = 0.02, double speed_noise = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Point> result;
  for (int i = 0; i < 40; ++i) {
    const double speed = 300 + 40.0 * i;
    result.push_back(
        {speed + speed_noise * normal(random), kTruth * speed * speed + noise * normal(random), 1, noise, speed_noise});
  }
  return result;
}

ThrustFitOptions with(Loss loss, Weighting weighting = Weighting::equal) {
  ThrustFitOptions options;
  options.loss = loss;
  options.weighting = weighting;
  return options;
}

class RobustFit : public ::testing::TestWithParam<Loss> {};

TEST_P(RobustFit, IsNotMovedByGlitchesAndNamesThem) {
  auto data = points(1);
  data[30].thrust_n *= 4;  // the speed read half of what it was
  data[35].thrust_n = 0;
  const double plain = fit_thrust(data).parameters.k;
  const ThrustFit fit = fit_thrust(data, with(GetParam()));
  EXPECT_GT(std::abs(plain / kTruth - 1), 0.05);
  EXPECT_NEAR(fit.parameters.k / kTruth, 1, 0.01);
  for (std::size_t i = 0; i < data.size(); ++i) {
    if (i == 30 || i == 35) {
      EXPECT_LT(fit.robust_weights[i], kRejectedWeight) << i;
    } else {
      EXPECT_GT(fit.robust_weights[i], kRejectedWeight) << i;
    }
  }
}

TEST_P(RobustFit, CoversTheTruthAsOftenAsItClaims) {
  int within = 0;
  const int draws = 200;
  for (int seed = 0; seed < draws; ++seed) {
    const ThrustFit fit = fit_thrust(points(static_cast<unsigned>(seed)), with(GetParam()));
    within += std::abs(fit.parameters.k - kTruth) < 2.02 * fit.standard_error.k ? 1 : 0;
  }
  EXPECT_GE(within, 0.90 * draws);
  EXPECT_LE(within, 0.99 * draws);
}

INSTANTIATE_TEST_SUITE_P(AllLosses, RobustFit, ::testing::Values(Loss::huber, Loss::cauchy, Loss::tukey));

TEST(ThrustFit, AgreesWithTheClosedForm) {
  const auto data = points(3);
  std::vector<double> x, y;
  for (const Point& point : data) {
    x.push_back(point.speed_rad_s * point.speed_rad_s);
    y.push_back(point.thrust_n);
  }
  const ThrustFit origin = fit_thrust(data);
  const Regression exact = regress_polynomial(x, y, 1, 1);
  EXPECT_NEAR(origin.parameters.k / exact.estimates[0], 1, 1e-13);
  EXPECT_NEAR(origin.standard_error.k / exact.standard_errors[0], 1, 1e-11);
  ThrustFitOptions options;
  options.form = ThrustForm::with_offset;
  const ThrustFit offset = fit_thrust(data, options);
  const Regression line = regress_polynomial(x, y, 0, 1);
  EXPECT_NEAR(offset.parameters.k / line.estimates[1], 1, 1e-12);
  EXPECT_NEAR(offset.standard_error.offset / line.standard_errors[0], 1, 1e-10);
  EXPECT_NEAR(offset.covariance[0][2] / (line.covariance[0][1] * std::pow(line.residual_deviation, 2)), 1, 1e-10);
}

TEST(ThrustFit, WeighsByTheErrorOfTheSpeedToo) {
  auto data = points(4, 1e-3, 5);  // 5 rad/s at 1900 rad/s are 0.03 N: far above the cell's noise
  const double thrust_only = fit_thrust(data, with(Loss::none, Weighting::thrust)).standard_error.k;
  const ThrustFit both = fit_thrust(data, with(Loss::none, Weighting::effective_variance));
  EXPECT_NEAR(both.parameters.k / kTruth, 1, 0.005);
  EXPECT_LT(both.points.back().weight, both.points.front().weight)
      << "an error of the speed counts where dT/dw is high";
  EXPECT_NE(both.standard_error.k, thrust_only);
  const double slope_ratio = data.back().speed_rad_s / data.front().speed_rad_s;
  EXPECT_NEAR(both.points.front().weight / both.points.back().weight, slope_ratio * slope_ratio, 2);
}

TEST(ThrustFit, ErrorsInSpeedAreCoveredByTheEffectiveVariance) {
  int within = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const ThrustFit fit = fit_thrust(points(seed, 2e-3, 5), with(Loss::none, Weighting::effective_variance));
    within += std::abs(fit.parameters.k - kTruth) < 2.02 * fit.standard_error.k ? 1 : 0;
  }
  EXPECT_GE(within, 180);
  EXPECT_LE(within, 198);
}

TEST(ThrustFit, RefusesToWeighByWhatNobodyKnows) {
  auto data = points(5);
  data[7].u_thrust_n = 0;
  EXPECT_THROW((void)fit_thrust(data, with(Loss::none, Weighting::thrust)), FitError);
}

TEST(ThrustFit, ALossWithoutScatterChangesNothing) {
  const auto data = points(6, 0);
  EXPECT_NEAR(fit_thrust(data, with(Loss::tukey)).parameters.k / kTruth, 1, 1e-14);
}

}  // namespace
}  // namespace kphi::fit
