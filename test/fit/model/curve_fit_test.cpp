#include "fit/model/curve_fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <vector>

#include "base/error.hpp"
#include "fit/numerics/linear_regression.hpp"
#include "test/source_dir.hpp"

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

/// "data y x" of a file of NIST. Of points at one x their mean, which weighs as many.
std::vector<CurvePoint> nist_points(const std::string& name, double error) {
  std::ifstream file(kphi::test::source_dir() + ("/test/fit/nist/" + name));
  std::vector<CurvePoint> points;
  std::vector<double> counts;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string word;
    double y = 0, x = 0;
    if (!(words >> word >> y >> x) || word != "data") continue;
    const auto same = std::ranges::find(points, x, &CurvePoint::phi_deg);
    if (same == points.end()) {
      points.push_back({x, y, error});
      counts.push_back(1);
      continue;
    }
    double& count = counts[static_cast<std::size_t>(same - points.begin())];
    same->k = (same->k * count + y) / (count + 1);
    same->standard_error = error / std::sqrt(++count);
  }
  return points;
}

/// Of a parameter, by its weights over points with these errors.
double error_of(const CurveParameter& parameter, std::vector<CurvePoint> points) {
  std::ranges::sort(points, {}, &CurvePoint::phi_deg);
  double variance = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    variance += std::pow(parameter.weights[i] * points[i].standard_error, 2);
  return std::sqrt(variance);
}

TEST(LineFit, AgreesWithNistsNorrisToTenDigits) {
  auto points = nist_points("Norris.txt", 1e-6);
  ASSERT_EQ(points.size(), 35u) << "36, two of them at one x";
  // Errors of k above the floor, and a residual deviation of 0.884796396144373 in NIST's errors.
  for (CurvePoint& point : points) point.standard_error *= 1e7;
  points.push_back({0, 700, 10});
  const CurveFit fit = fit_curve(points);
  EXPECT_NEAR(fit.value("intercept") / -0.262323073774029, 1, 1e-10);
  EXPECT_NEAR(fit.value("slope_per_deg") / 1.00211681802045, 1, 1e-10);
  const double share = 0.884796396144373 / 10;
  EXPECT_NEAR(share * error_of(*fit.find("intercept"), points) / 0.232818234301152, 1, 1e-9);
  EXPECT_NEAR(share * error_of(*fit.find("slope_per_deg"), points) / 0.429796848199937e-3, 1, 1e-9);
}

TEST(LineFit, AnchoredAgreesWithNistsNoIntToTenDigits) {
  auto points = nist_points("NoInt1.txt", 10);
  ASSERT_EQ(points.size(), 11u);
  points.push_back({0, 0, 10});
  const CurveFit fit = fit_curve(points, {.anchored = true});
  EXPECT_NEAR(fit.value("slope_per_deg") / 2.07438016528926, 1, 1e-10);
  points.back().standard_error = 0;  // NIST's origin has no error
  EXPECT_NEAR(3.56753034006338 / 10 * error_of(*fit.find("slope_per_deg"), points) / 0.165289256198347e-1, 1, 1e-9);
}

/// Points of known errors about the paper's line.
std::vector<CurvePoint> noisy_points(std::mt19937& random) {
  std::normal_distribution<double> noise;
  std::uniform_real_distribution<double> error(3e-9, 3e-8);
  auto points = paper_points();
  for (CurvePoint& point : points) {
    point.standard_error = error(random);
    point.k += point.standard_error * noise(random);
  }
  return points;
}

TEST(LineFit, WeighsTheKAsTheClosedFormDoes) {
  std::mt19937 random(8);
  for (int trial = 0; trial < 50; ++trial) {
    const auto points = noisy_points(random);
    for (const bool anchored : {false, true}) {
      const CurveFit fit = fit_curve(points, {.anchored = anchored});
      // The derivatives by each k of the closed form.
      std::vector<double> phi, weights;
      for (std::size_t i = 1; i < points.size(); ++i) {
        phi.push_back(points[i].phi_deg);
        weights.push_back(1 / (points[i].standard_error * points[i].standard_error));
      }
      double of_K_T = 0;
      for (std::size_t i = 1; i < points.size(); ++i) {
        std::vector<double> unit(phi.size());
        unit[i - 1] = 1;
        const auto by = regress_polynomial(phi, unit, anchored ? 1 : 0, 1, weights).estimates;
        of_K_T -= by.back();
        EXPECT_NEAR(fit.find("slope_per_deg")->weights[i] / by.back(), 1, 1e-10);
        if (!anchored) {
          EXPECT_NEAR(fit.find("intercept")->weights[i] / by.front(), 1, 1e-10);
        }
      }
      EXPECT_NEAR(fit.find("slope_per_deg")->weights[0], anchored ? of_K_T : 0, 1e-10 * std::abs(of_K_T));
      EXPECT_EQ(fit.find("intercept")->weights[0], anchored ? 1 : 0);
    }
  }
}

/// A joint fit of every step, T = (intercept + slope φ + b_run) ω² with b_run of `between` from run to run and `noise`
/// in each thrust: least squares on what whitens them. The line through the k of the occlusions is to be the same.
TEST(LineFit, IsThatOfAllStepsFittedJointlyWhereTheirRunsScatter) {
  constexpr double kBetween = 8e-9, kNoiseN = 0.01;
  constexpr int kRepetitions = 3;
  std::mt19937 random(11);
  std::normal_distribution<double> normal;
  std::vector<double> x;  // of one run, ω²
  for (double omega = 300; omega <= 2000; omega += 50) x.push_back(omega * omega);
  double xx = 0;
  for (const double one : x) xx += one * one;
  std::vector<std::vector<double>> rows;
  std::vector<double> whitened;
  std::vector<CurvePoint> points = paper_points(0);
  for (CurvePoint& point : points) {
    // The first occlusion was measured twice only: its k weighs less.
    const int runs = point.phi_deg == 45 ? kRepetitions - 1 : kRepetitions;
    double k = 0;
    for (int run = 0; run < runs; ++run) {
      const double of_run = point.k + kBetween * normal(random);
      std::vector<double> thrusts;
      double xt = 0;
      for (const double one : x) {
        thrusts.push_back(of_run * one + kNoiseN * normal(random));
        xt += one * thrusts.back();
      }
      k += xt / xx / runs;
      if (point.phi_deg == 0) continue;
      // Along x the variance is that of the noise and of b; everywhere else that of the noise.
      const double along = 1 / std::sqrt(kNoiseN * kNoiseN + kBetween * kBetween * xx), beside = 1 / kNoiseN;
      for (std::size_t i = 0; i < x.size(); ++i) {
        const auto white = [&](double own, double projected) { return beside * own + (along - beside) * projected; };
        whitened.push_back(white(thrusts[i], x[i] * xt / xx));
        rows.push_back({white(x[i], x[i]), white(x[i], x[i]) * point.phi_deg});
      }
    }
    point.k = k;
    point.standard_error = std::sqrt((kBetween * kBetween + kNoiseN * kNoiseN / xx) / runs);
  }
  const Regression jointly = regress(rows, whitened);
  const CurveFit line = fit_curve(points);
  EXPECT_NEAR(line.value("intercept") / jointly.estimates[0], 1, 1e-10);
  EXPECT_NEAR(line.value("slope_per_deg") / jointly.estimates[1], 1, 1e-10);
  EXPECT_NEAR(error_of(*line.find("slope_per_deg"), points) / std::sqrt(jointly.covariance[1][1]), 1, 1e-9);
}

class RobustLine : public ::testing::TestWithParam<Loss> {};

TEST_P(RobustLine, OfGoodPointsIsNextToTheLineWithoutALoss) {
  std::mt19937 random(3);
  double squares = 0, plain_squares = 0, within = 0;
  constexpr int kTrials = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto points = noisy_points(random);
    const CurveFit plain = fit_curve(points), robust = fit_curve(points, {.loss = GetParam()});
    const CurveParameter at_135{.weights = robust.weights_at(135)};
    within +=
        std::abs(robust.k_at(135) - kThrustCoefficient * (1.03 - 0.65 / 225 * 135)) <= 1.96 * error_of(at_135, points);
    squares += std::pow(robust.k_at(135) / paper_points()[0].k - (1.03 - 0.65 / 225 * 135), 2);
    plain_squares += std::pow(plain.k_at(135) / paper_points()[0].k - (1.03 - 0.65 / 225 * 135), 2);
  }
  EXPECT_LT(squares / plain_squares, 1.15) << "95 % efficient with many points, here are four";
  EXPECT_NEAR(within / kTrials, 0.95, 0.025) << "three deviations are 0.021";
}

TEST_P(RobustLine, IsALinearFunctionOfTheKWithTheWeightsOfTheLoss) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 50; ++trial) {
    auto points = noisy_points(random);
    points[3].k += 4 * points[3].standard_error;
    for (const bool anchored : {false, true}) {
      const CurveFit fit = fit_curve(points, {.anchored = anchored, .loss = GetParam()});
      std::vector<double> phi, k, weights;
      for (std::size_t i = 0; i < fit.points.size(); ++i) {
        phi.push_back(fit.points[i].phi_deg);
        k.push_back(fit.points[i].k - (anchored ? fit.K_T : 0));
        weights.push_back(fit.robust_weights[i] / (fit.sigmas[i] * fit.sigmas[i]));
        EXPECT_GE(fit.robust_weights[i], 0);
        EXPECT_LE(fit.robust_weights[i], 1);
      }
      const auto closed = regress_polynomial(phi, k, anchored ? 1 : 0, 1, weights).estimates;
      EXPECT_NEAR(fit.value("slope_per_deg") / closed.back(), 1, 1e-6) << "the weights are those at the line itself";
      for (const CurveParameter& parameter : fit.parameters) {
        double value = 0;
        for (std::size_t i = 0; i < points.size(); ++i) value += parameter.weights[i] * points[i].k;
        EXPECT_NEAR(value / parameter.value, 1, 1e-11) << parameter.key;
      }
    }
  }
}

TEST_P(RobustLine, LetsAPointFarFromTheOthersPullLess) {
  auto points = paper_points(1e-8);
  points.insert(points.begin() + 3, {135, kThrustCoefficient * (1.03 - 0.65 / 225 * 135), 1e-8});
  points[3].k -= 20 * points[3].standard_error;
  const CurveFit plain = fit_curve(points), robust = fit_curve(points, {.loss = GetParam()});
  const double truth = kThrustCoefficient * (1.03 - 0.65 / 225 * 90);
  EXPECT_LT(std::abs(robust.k_at(90) - truth), 0.35 * std::abs(plain.k_at(90) - truth));
  EXPECT_LT(robust.robust_weights[2], kRejectedWeight);
  EXPECT_NE(robust.remarks({}, 270)[1].find("loss rejects k at 135°"), std::string::npos) << robust.remarks({}, 270)[1];
  EXPECT_NE(robust.model().words(robust).find(name_of(GetParam())), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(AllLosses, RobustLine, ::testing::Values(Loss::huber, Loss::cauchy, Loss::tukey),
                         [](const auto& loss) { return std::string(name_of(loss.param)); });

TEST(LineFit, RefusesALossThatItCannotScaleOrWhereNothingIsLeft) {
  auto points = paper_points(1e-8);
  EXPECT_THROW((void)fit_curve(points, {.form = CurveForm::table, .loss = Loss::huber}), FitError);
  points[2].standard_error = 0;
  EXPECT_THROW((void)fit_curve(points, {.loss = Loss::huber}), FitError);
  auto zigzag = paper_points(1e-8);
  for (std::size_t i = 1; i < zigzag.size(); ++i) zigzag[i].k += (i % 2 == 0 ? 1 : -1) * 40 * zigzag[i].standard_error;
  EXPECT_THROW((void)fit_curve(zigzag, {.loss = Loss::tukey}), FitError);
  EXPECT_NO_THROW((void)fit_curve(zigzag, {.loss = Loss::huber}));
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
