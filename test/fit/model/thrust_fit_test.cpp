#include "fit/model/thrust_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
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

TEST(ThrustFit, AgreesWithTheClosedFormThroughTheOrigin) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const auto points = curve({kTruth, 0, 0}, 0.05, seed);
    double tw2 = 0, w4 = 0, sse = 0;
    for (const auto& p : points) {
      tw2 += p.thrust_n * std::pow(p.speed_rad_s, 2);
      w4 += std::pow(p.speed_rad_s, 4);
    }
    const double k = tw2 / w4;
    for (const auto& p : points) sse += std::pow(p.thrust_n - k * p.speed_rad_s * p.speed_rad_s, 2);
    const double rms = std::sqrt(sse / static_cast<double>(points.size() - 1));
    const ThrustFit fit = fit_thrust(points);
    EXPECT_NEAR(fit.parameters.k / k, 1, 1e-12);
    EXPECT_NEAR(fit.rms_n / rms, 1, 1e-9);
    EXPECT_NEAR(fit.standard_error.k / (rms / std::sqrt(w4)), 1, 1e-9);
  }
}

TEST(ThrustFit, AgreesWithTheClosedFormWithOffsetAndWeights) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> weight(0.2, 5);
  for (unsigned seed = 0; seed < 50; ++seed) {
    auto points = curve({kTruth, 0, -0.07}, 0.02, seed);
    double s = 0, sx = 0, sxx = 0, sy = 0, sxy = 0, sse = 0;
    for (auto& p : points) {
      p.weight = weight(random);
      const double x = p.speed_rad_s * p.speed_rad_s;
      s += p.weight;
      sx += p.weight * x;
      sxx += p.weight * x * x;
      sy += p.weight * p.thrust_n;
      sxy += p.weight * x * p.thrust_n;
    }
    const double determinant = s * sxx - sx * sx;
    const double k = (s * sxy - sx * sy) / determinant;
    const double offset = (sxx * sy - sx * sxy) / determinant;
    for (const auto& p : points) sse += p.weight * std::pow(p.thrust_n - k * p.speed_rad_s * p.speed_rad_s - offset, 2);
    const double rms = std::sqrt(sse / static_cast<double>(points.size() - 2));
    const ThrustFit fit = fit_thrust(points, {.form = ThrustForm::with_offset});
    EXPECT_NEAR(fit.parameters.k / k, 1, 1e-11);
    EXPECT_NEAR(fit.parameters.offset, offset, 1e-10);
    EXPECT_NEAR(fit.standard_error.k / (rms * std::sqrt(s / determinant)), 1, 1e-9);
    EXPECT_NEAR(fit.standard_error.offset / (rms * std::sqrt(sxx / determinant)), 1, 1e-9);
  }
}

TEST(ThrustFit, FindsThreeTerms) {
  const ThrustParameters<double> truth{1.3298e-6, 3.836e-5, -0.05};
  const ThrustFit fit = fit_thrust(curve(truth, 0, 1), {.form = ThrustForm::three_terms});
  EXPECT_NEAR(fit.parameters.k / truth.k, 1, 1e-9);
  EXPECT_NEAR(fit.parameters.linear / truth.linear, 1, 1e-8);
  EXPECT_NEAR(fit.parameters.offset / truth.offset, 1, 1e-8);
}

TEST(ThrustFit, StandardErrorCoversTheTruthAsOftenAsItClaims) {
  int within = 0;
  for (unsigned seed = 0; seed < 1000; ++seed) {
    const ThrustFit fit = fit_thrust(curve({kTruth, 0, 0}, 0.05, seed));
    within += std::abs(fit.parameters.k - kTruth) <= fit.standard_error.k ? 1 : 0;
  }
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
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW((void)fit_thrust({}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{100, 1, 1}}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{0, 1, 1}, {0, 1, 1}}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{100, nan, 1}, {200, 1, 1}}), FitError);
  EXPECT_THROW((void)fit_thrust(std::vector<Point>{{100, 1, 0}, {200, 1, 1}}), FitError);
  EXPECT_THROW(
      (void)fit_thrust(std::vector<Point>{{100, 1, 1}, {100, 1, 1}, {100, 1, 1}}, {.form = ThrustForm::with_offset}),
      FitError)
      << "one speed cannot tell an offset from a slope";
}

TEST(CoefficientAtASpeed, IsTheMeanOfTheRepetitionsWithItsStandardError) {
  const std::vector<Point> repetitions{{2000, 6.0, 1}, {2000, 6.2, 1}, {2000, 6.4, 1}};
  const SpeedCoefficient result = k_at_speed(repetitions);
  EXPECT_NEAR(result.k, 6.2 / 4e6, 1e-18);
  EXPECT_NEAR(result.standard_error, 0.2 / 4e6 / std::sqrt(3.0), 1e-18);
  EXPECT_EQ(result.repetitions, 3u);
}

TEST(CoefficientAtASpeed, HasNoStandardErrorFromOneRepetition) {
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

// ---- with losses and weights
// -------------------------------------------------------------------------------------------

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
  ThrustFitOptions options;
  options.loss = loss;
  options.weighting = weighting;
  return options;
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
    const ThrustFit fit = fit_thrust(noisy_points(static_cast<unsigned>(seed)), with(GetParam()));
    within += std::abs(fit.parameters.k - kRobustTruth) < 2.02 * fit.standard_error.k ? 1 : 0;
  }
  EXPECT_GE(within, 0.90 * draws);
  EXPECT_LE(within, 0.99 * draws);
}

INSTANTIATE_TEST_SUITE_P(AllLosses, RobustFit, ::testing::Values(Loss::huber, Loss::cauchy, Loss::tukey));

TEST(ThrustFit, AgreesWithTheClosedForm) {
  const auto data = noisy_points(3);
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
  int within = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const ThrustFit fit = fit_thrust(noisy_points(seed, 2e-3, 5), with(Loss::none, Weighting::effective_variance));
    within += std::abs(fit.parameters.k - kRobustTruth) < 2.02 * fit.standard_error.k ? 1 : 0;
  }
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
