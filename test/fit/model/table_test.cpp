// The table k(φ).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "fit/model/curve_fit.hpp"

namespace kphi::fit {
namespace table_test {

constexpr double kU = 1e-9;

CurveFit table_of(const std::vector<CurvePoint>& points, std::vector<double> carriers = {}) {
  return fit_curve(points, {.form = CurveForm::table, .points_deg = std::move(carriers)});
}

TEST(TableFit, GoesThroughEveryMeasuredKThatFalls) {
  const std::vector<CurvePoint> points{
      {0, 1.55e-6, kU}, {45, 1.50e-6, kU}, {90, 1.30e-6, kU}, {180, 0.7e-6, kU}, {270, 0.45e-6, kU}};
  const CurveFit table = table_of(points);
  for (const CurvePoint& point : points) EXPECT_NEAR(table.k_at(point.phi_deg) / point.k, 1, 1e-12);
  EXPECT_NEAR(table.k_at(135), 1.0e-6, 1e-18);
  EXPECT_TRUE(table.anchored);
  EXPECT_EQ(table.spare_points(), 0);
  EXPECT_FALSE(table.tested(10).bends()) << "whatever falls is a table";
  EXPECT_NEAR(table.falls_to(1.0e-6).value(), 135, 1e-9);
  EXPECT_NEAR(table.clipping_deg().value(), 0, 1e-9);
  EXPECT_NEAR(table.zero_crossing_deg().value(), 270 + 0.45 / 0.25 * 90, 1e-9);
}

TEST(TableFit, GivesNeighboursThatRiseTheirMeanAndNoneMoreThanKT) {
  const CurveFit table =
      table_of({{0, 1.0e-6, 2 * kU}, {45, 1.02e-6, 2 * kU}, {90, 0.8e-6, 2 * kU}, {180, 0.9e-6, 4 * kU}});
  EXPECT_EQ(table.k_at(45), 1.0e-6);
  EXPECT_NEAR(table.k_at(90), (0.8e-6 * 4 + 0.9e-6) / 5, 1e-18);
  EXPECT_NEAR(table.k_at(180), table.k_at(90), 1e-18);
  EXPECT_EQ(table.spare_points(), 1);
  EXPECT_TRUE(table.tested(10).bends()) << "0.1 apart with u = 0.001: no noise";
  EXPECT_NEAR(table.clipping_deg().value(), 45, 1e-9);
}

/// Least squares under the order, by Dykstra's projections onto one pair after the other.
std::vector<double> falling_least_squares(std::vector<double> k, const std::vector<double>& sigmas, double most) {
  const std::size_t n = k.size();
  std::vector<std::vector<double>> corrections(n, std::vector<double>(n));
  for (int round = 0; round < 20'000; ++round) {
    for (std::size_t i = 0; i < n; ++i) {
      std::vector<double> before = k;
      for (std::size_t j = 0; j < n; ++j) before[j] = k[j] + corrections[i][j];
      k = before;
      if (i == 0) {
        k[0] = std::min(k[0], most);
      } else if (k[i] > k[i - 1]) {
        const double a = 1 / (sigmas[i - 1] * sigmas[i - 1]), b = 1 / (sigmas[i] * sigmas[i]);
        k[i - 1] = k[i] = (a * k[i - 1] + b * k[i]) / (a + b);
      }
      for (std::size_t j = 0; j < n; ++j) corrections[i][j] = before[j] - k[j];
    }
  }
  return k;
}

TEST(TableFit, IsTheLeastSquaresFitOfAKThatDoesNotRise) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> share(0.3, 1.1), error(0.005, 0.05);
  for (int i = 0; i < 40; ++i) {
    std::vector<CurvePoint> points{{0, 1e-6, 5e-9}};
    std::vector<double> k, sigmas;
    for (int j = 1; j <= 6; ++j) {
      points.push_back({30.0 * j, 1e-6 * share(random), 1e-6 * error(random)});
      k.push_back(points.back().k * 1e6);
      sigmas.push_back(points.back().standard_error * 1e6);
    }
    const CurveFit table = table_of(points);
    const std::vector<double> expected = falling_least_squares(k, sigmas, 1.0);
    for (int j = 1; j <= 6; ++j) EXPECT_NEAR(1e6 * table.k_at(30.0 * j), expected[j - 1], 1e-6) << i << " " << j;
    EXPECT_TRUE(table.curve().at(from_degrees(75)).value() > 0) << "it flies";
  }
}

TEST(TableFit, OfNoiseAloneIsRejectedAsRarelyAsItsTestSays) {
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  int rejected = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    std::vector<CurvePoint> points{{0, 2e-6, kU}};
    for (int j = 1; j <= 5; ++j) points.push_back({40.0 * j, 1e-6 + kU * normal(random), kU});
    rejected += table_of(points).tested(1e9).bends() ? 1 : 0;
  }
  EXPECT_LT(rejected, 0.07 * kDraws) << "a k that stays the same is the worst case";
  EXPECT_GT(rejected, 0);
}

TEST(TableFit, HoldsAsManyAnglesAsTheLibraryThatFlies) {
  std::vector<CurvePoint> points;
  std::vector<double> eleven;
  for (int i = 0; i <= 12; ++i) {
    points.push_back({20.0 * i, 1e-6 - 1e-8 * i, kU});
    if (i > 0 && i < 12) eleven.push_back(20.0 * i);
  }
  try {
    (void)table_of(points);
    FAIL() << "too many";
  } catch (const FitError& error) {
    EXPECT_THAT(error.what(), ::testing::HasSubstr("choose them with --points"));
  }
  const CurveFit table = table_of(points, eleven);
  EXPECT_NEAR(table.k_at(240), 1e-6 - 12e-8, 1e-18) << "goes on beyond the last that carries it";
  EXPECT_NEAR(table.curve(240).at(from_degrees(240)).value(), 1e-6 - 12e-8, 1e-18);
}

}  // namespace table_test
}  // namespace kphi::fit
