#include "fit/model/curve_fit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "base/error.hpp"

namespace kphi::fit {
namespace curve_fit_test {

constexpr double kThrustCoefficient = 1.55e-6;

/// The paper's 5-inch propeller with three blades: 90 % at 45°, 25 % at 270°, straight between.
std::vector<CurvePoint> paper_points(double standard_error = 1e-9) {
  std::vector<CurvePoint> points{{0, kThrustCoefficient, standard_error}};
  for (const double phi : {45.0, 90.0, 180.0, 270.0})
    points.push_back({phi, kThrustCoefficient * (1.03 - 0.65 / 225 * phi), standard_error});
  return points;
}

TEST(CurveFit, OfEveryFormIsALinearFunctionOfTheMeasuredKAndFliesAsItWasFitted) {
  const auto points = paper_points();
  for (const CurveForm form : kCurveForms) {
    for (const bool anchored : {false, true}) {
      const CurveFit fit = fit_curve(points, {.form = form, .anchored = anchored});
      const std::string words = name_of(form) + std::string(anchored ? ", anchored" : ", free");
      EXPECT_EQ(fit.form, form);
      EXPECT_GE(fit.spare_points(), 0) << words;
      EXPECT_LT(fit.spare_points(), static_cast<double>(fit.points.size())) << words;
      EXPECT_NE(fit.model().words(fit).find(name_of(form)), std::string::npos) << words;
      EXPECT_NE(std::string(fit.model().denial()), "") << words;
      for (const double phi : {0.0, 30.0, 45.0, 100.0, 270.0}) {
        const std::vector<double> weights = fit.weights_at(phi);
        double k = 0;
        for (std::size_t i = 0; i < points.size(); ++i) k += weights[i] * points[i].k;
        EXPECT_NEAR(fit.k_at(phi) / k, 1, 1e-12) << words << phi;
        EXPECT_NEAR(fit.curve().at(from_degrees(phi)).value() / k, 1, 1e-12) << words << phi;
      }
      for (const CurveParameter& parameter : fit.parameters) {
        double value = 0;
        for (std::size_t i = 0; i < points.size(); ++i) value += parameter.weights[i] * points[i].k;
        EXPECT_NEAR(parameter.value / value, 1, 1e-11) << words << ": " << parameter.key;
      }
      for (std::size_t i = 0; i < fit.points.size(); ++i)
        EXPECT_EQ(fit.residuals[i], fit.points[i].k - fit.k_at(fit.points[i].phi_deg)) << words;
      EXPECT_NEAR(fit.k_at(fit.falls_to(0.5 * kThrustCoefficient).value()) / kThrustCoefficient, 0.5, 1e-9) << words;
      EXPECT_EQ(anchored || form == CurveForm::table, fit.anchored) << words;
      EXPECT_EQ(fit.anchored, std::abs(fit.mismatch()) < 1e-18) << words;
    }
  }
}

TEST(LineFit, FindsThePapersLineThroughTheOccludedPoints) {
  const CurveFit fit = fit_curve(paper_points());
  EXPECT_NEAR(fit.value("intercept") / kThrustCoefficient, 1.03, 1e-12);
  EXPECT_NEAR(fit.value("slope_per_deg") / kThrustCoefficient, -0.65 / 225, 1e-14);
  EXPECT_EQ(fit.points.size(), 4u);
  EXPECT_NEAR(fit.mismatch() / kThrustCoefficient, 0.03, 1e-12);
  EXPECT_NEAR(*fit.clipping_deg(), 10.3846, 1e-3);
  EXPECT_NEAR(*fit.zero_crossing_deg(), 356.54, 1e-2);
}

TEST(LineFit, LeavesThePointAtZeroOutUnlessAskedForIt) {
  auto points = paper_points();
  const CurveFit apart = fit_curve(points);
  points.front().k *= 1.1;
  const CurveFit moved = fit_curve(points);
  EXPECT_NEAR(apart.value("slope_per_deg") / moved.value("slope_per_deg"), 1, 1e-12);
  EXPECT_NE(apart.K_T, moved.K_T);
  const CurveFit with_zero = fit_curve(paper_points(), {.points_deg = {0, 45, 90, 180, 270}});
  // facts: free through the four points and (0, 1): -0.002814 per degree, 1.0153
  EXPECT_NEAR(with_zero.value("slope_per_deg") / kThrustCoefficient, -0.002814, 2e-6);
  EXPECT_NEAR(with_zero.value("intercept") / kThrustCoefficient, 1.0153, 1e-4);
}

TEST(LineFit, AnchoredStartsAtTheMeasuredThrustCoefficient) {
  const CurveFit fit = fit_curve(paper_points(), {.anchored = true});
  EXPECT_EQ(fit.value("intercept"), kThrustCoefficient);
  EXPECT_EQ(fit.mismatch(), 0);
  EXPECT_NEAR(fit.value("slope_per_deg") / kThrustCoefficient, -0.0027368, 1e-6);
  EXPECT_NEAR(fit.curve().at(from_degrees(45)).value() / kThrustCoefficient, 0.877, 5e-4);
  EXPECT_NEAR(fit.curve().at(from_degrees(270)).value() / kThrustCoefficient, 0.261, 5e-4);
  EXPECT_NEAR(*fit.zero_crossing_deg(), 365.4, 0.1);
  EXPECT_NEAR(*fit.clipping_deg(), 0, 1e-12);
}

TEST(LineFit, IsTheClosedFormOfAWeightedLine) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  std::uniform_real_distribution<double> error(3e-9, 3e-8);
  for (int trial = 0; trial < 100; ++trial) {
    auto points = paper_points();
    double s = 0, sx = 0, sxx = 0, sy = 0, sxy = 0;
    for (auto& p : points) {
      p.standard_error = error(random);
      p.k += p.standard_error * noise(random) * (trial % 2 == 0 ? 0.1 : 3);
      if (p.phi_deg == 0) continue;
      const double w = 1 / (p.standard_error * p.standard_error);
      s += w;
      sx += w * p.phi_deg;
      sxx += w * p.phi_deg * p.phi_deg;
      sy += w * p.k;
      sxy += w * p.phi_deg * p.k;
    }
    const double determinant = s * sxx - sx * sx;
    const CurveFit fit = fit_curve(points);
    EXPECT_NEAR(fit.value("intercept") / ((sxx * sy - sx * sxy) / determinant), 1, 1e-11);
    EXPECT_NEAR(fit.value("slope_per_deg") / ((s * sxy - sx * sy) / determinant), 1, 1e-11);
  }
}

TEST(LineFit, FloorsTheErrorsSoThatOneRunCannotRuleTheLine) {
  auto points = paper_points(1e-8);
  points[1].standard_error = 1e-20;
  points[1].k *= 1.02;
  const CurveFit fit = fit_curve(points);
  EXPECT_GT(std::abs(fit.residuals[0]), 1e-4 * points[1].k);
}

TEST(LineFit, TakesTheFloorWhereAnErrorIsNotKnown) {
  auto points = paper_points(0);
  points[2].standard_error = std::numeric_limits<double>::quiet_NaN();
  const CurveFit fit = fit_curve(points);
  EXPECT_NEAR(fit.value("intercept") / kThrustCoefficient, 1.03, 1e-12);
  EXPECT_NEAR(fit.K_T_standard_error / (1e-3 * kThrustCoefficient), 1, 1e-12);
}

TEST(LineFit, UsesTheChosenPointsInAnyOrder) {
  auto points = paper_points();
  points[1].k *= 2;
  const CurveFit fit = fit_curve(points, {.points_deg = {270, 90, 180}});
  EXPECT_NEAR(fit.value("intercept") / kThrustCoefficient, 1.03, 1e-12);
  ASSERT_EQ(fit.points.size(), 3u);
  EXPECT_EQ(fit.points.front().phi_deg, 90);
}

TEST(LineFit, HasNoCrossingsUnlessItFalls) {
  std::vector<CurvePoint> rising{{0, 1e-6, 0}, {90, 1.1e-6, 0}, {180, 1.2e-6, 0}};
  const CurveFit fit = fit_curve(rising);
  EXPECT_FALSE(fit.clipping_deg());
  EXPECT_FALSE(fit.zero_crossing_deg());
}

TEST(LineFit, RefusesWhatMakesNoLine) {
  const auto points = paper_points();
  EXPECT_THROW((void)fit_curve(std::vector<CurvePoint>{}), FitError);
  EXPECT_THROW((void)fit_curve(std::vector<CurvePoint>(points.begin() + 1, points.end())), FitError) << "no K_T";
  EXPECT_THROW((void)fit_curve(std::vector<CurvePoint>{points[0], points[1]}), FitError);
  EXPECT_NO_THROW((void)fit_curve(std::vector<CurvePoint>{points[0], points[1]}, {.anchored = true}));
  EXPECT_THROW((void)fit_curve(std::vector<CurvePoint>{points[0], points[1], points[1]}), FitError);
  EXPECT_THROW((void)fit_curve(points, {.points_deg = {45, 60}}), FitError);
  EXPECT_THROW((void)fit_curve(points, {.points_deg = {45, 45}}), FitError);
  EXPECT_THROW((void)fit_curve(points, {.anchored = true, .points_deg = {0}}), FitError);
}

std::vector<CurvePoint> points(double bend, double error = 0.01) {
  std::vector<CurvePoint> result;
  for (const double phi : {45.0, 90.0, 180.0, 270.0}) {
    const double u = phi / 270;
    result.push_back({phi, 1 - 0.7 * u + bend * u * u, error});
  }
  return result;
}

TEST(Curvature, OfALineIsNothing) {
  const Curvature found = curvature(points(0), 10);
  EXPECT_NEAR(found.lack_of_fit.value, 0, 1e-12);
  EXPECT_FALSE(found.bends());
}

TEST(Curvature, OfAParabolaIsMeasured) {
  const Curvature found = curvature(points(0.2), 10);
  EXPECT_TRUE(found.lack_of_fit.rejected());
  EXPECT_TRUE(found.quadratic.rejected());
  EXPECT_NEAR(found.second_order, 0.2 / (270 * 270), 1e-12);
  EXPECT_NEAR(std::pow(found.second_order / found.second_order_u, 2) / found.quadratic.value, 1, 1e-9);
  EXPECT_EQ(found.lack_of_fit.freedom, 2);
  EXPECT_EQ(found.quadratic.error_freedom, 10);
  EXPECT_FALSE(curvature(points(0.2, 0.2), 10).bends()) << "the same bend is nothing where the errors are large";
}

TEST(Curvature, OfThreePointsHasOneTest) {
  auto three = points(0.2);
  three.pop_back();
  const Curvature found = curvature(three, 10);
  EXPECT_NEAR(found.lack_of_fit.p, found.quadratic.p, 1e-12);
  three.pop_back();
  EXPECT_FALSE(curvature(three, 10).lack_of_fit.tested());
  EXPECT_FALSE(curvature(points(0.2, 0), 10).bends()) << "without errors nothing can be said";
}

}  // namespace curve_fit_test
}  // namespace kphi::fit
