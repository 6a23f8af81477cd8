#include "fit/model/thrust_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/error.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

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

TEST(ThrustFit, UsesOnlyTheSpeedRange) {
  auto points = curve({kTruth, 0, 0}, 0, 1);
  points[0].thrust_n = 100;
  const ThrustFit fit = fit_thrust(points, {.speed_min_rad_s = from_rpm(3000).value()});
  EXPECT_NEAR(fit.parameters.k / kTruth, 1, 1e-12);
  EXPECT_EQ(fit.n, 34u);
  EXPECT_GE(fit.speed_min_rad_s, from_rpm(3000).value());
  EXPECT_NEAR(to_rpm(RadPerSec(fit.speed_max_rad_s)), 19100, 1e-6);
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

}  // namespace
}  // namespace kphi::fit
