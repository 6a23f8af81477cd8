#include "compensation/thrust_curve.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <type_traits>
#include <utility>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace thrust_curve_test {

double factor(const ThrustCurve& line, double phi_deg, ScalingLaw law) {
  return line.scaling_factor(from_degrees(phi_deg), law);
}

TEST(ThrustCurve, GivesTheScalingFactorsAndSpeedRatiosOfThePapersLine) {
  const ThrustCurve line = paper_line();
  struct Known {
    double phi_deg, k, speed_ratio;
  };
  for (const Known known : {Known{45, .9000, 1.0541}, Known{65, .8422, 1.0896}, Known{90, .7700, 1.1396},
                            Known{180, .5100, 1.4003}, Known{270, .2500, 2.0}}) {
    for (const ScalingLaw law : {ScalingLaw::clamped, ScalingLaw::published}) {
      EXPECT_NEAR(factor(line, known.phi_deg, law), known.k, 5e-5) << known.phi_deg;
      EXPECT_NEAR(1 / std::sqrt(factor(line, known.phi_deg, law)), known.speed_ratio, 1e-4) << known.phi_deg;
    }
  }
}

TEST(ThrustCurve, PublishedLawReflectsWhereTheLineLiesAboveTheThrustCoefficientAndGoesNegativeBeyond356Degrees) {
  const ThrustCurve line = paper_line();
  EXPECT_NEAR(factor(line, 0, ScalingLaw::published), 0.97, 1e-12);
  EXPECT_NEAR(factor(line, 10.384, ScalingLaw::published), 1.0, 1e-5);
  EXPECT_LT(factor(line, 5, ScalingLaw::published), 1.0);
  EXPECT_NEAR(1 / std::sqrt(factor(line, 356, ScalingLaw::published)), 25.0, 1.5);
  EXPECT_LT(factor(line, 358, ScalingLaw::published), 0.0);
}

TEST(ThrustCurve, ClampedLawIsExactlyOneWithoutOcclusionWhateverTheIntercept) {
  for (const double intercept : {0.9, 1.0, 1.03}) {
    for (const double none : {0.0, -0.0})
      EXPECT_EQ(example_line(intercept, -0.0028889).scaling_factor(Radians(none)), 1.0);
  }
}

TEST(ThrustCurve, ClampedLawNeverSlowsAPropellerDownNorGoesBelowTheFloor) {
  const ThrustCurve line = paper_line();
  EXPECT_EQ(factor(line, 5, ScalingLaw::clamped), 1.0);
  for (const double phi : {340.0, 360.0}) EXPECT_EQ(factor(line, phi, ScalingLaw::clamped), kScalingFloor);
  for (const double odd : {kNaN, kInfinity, -kInfinity, 1e308}) {
    const double k = line.scaling_factor(Radians(odd));
    EXPECT_TRUE(k >= kScalingFloor && k <= 1.0) << odd;
  }
}

TEST(ThrustCurve, AtIsTheLineItself) {
  const ThrustCurve line = paper_line();
  EXPECT_DOUBLE_EQ(line.at(Radians(0)) / line.thrust_coefficient(), 1.03);
  EXPECT_NEAR(line.at(from_degrees(356.5371)) / line.thrust_coefficient(), 0.0, 1e-6);
}

TEST(ThrustCurve, CannotExistInvalid) {
  const ThrustCoefficient k(1.55e-6);
  const Radians reach(4.7);
  EXPECT_TRUE(ThrustCurve::from_line(k, k, -1e-7, reach));
  EXPECT_TRUE(ThrustCurve::from_line(k, k, +1e-7, reach)) << "no loss is odd, not invalid";
  for (const double bad : {kNaN, kInfinity, -kInfinity, 0.0, -1e-6}) {
    EXPECT_FALSE(ThrustCurve::from_line(ThrustCoefficient(bad), k, -1e-7, reach)) << bad;
    EXPECT_FALSE(ThrustCurve::from_line(k, ThrustCoefficient(bad), -1e-7, reach)) << bad;
    EXPECT_FALSE(ThrustCurve::from_line(k, k, -1e-7, Radians(bad))) << bad;
  }
  for (const double bad : {kNaN, kInfinity, -kInfinity}) EXPECT_FALSE(ThrustCurve::from_line(k, k, bad, reach)) << bad;
  EXPECT_FALSE(ThrustCurve::from_line(k, k, -1e-7, Radians(6.3)));
}

ThrustCurve line_with(const LineUncertainty& uncertainty) {
  return *paper_line_if(OverlapMeasure::rim_arc, uncertainty);
}

/// 1 % of K_T, 1.5 % of the intercept, 4 % of the slope, correlated as lines through distant points are.
LineUncertainty example_uncertainty() {
  const double k = kExampleCoefficient.value();
  const double intercept = 0.015 * k, slope = 0.04 * line_of(paper_line()).slope_per_rad;
  return {0.01 * k, intercept * intercept, 0.8 * intercept * slope, slope * slope};
}

TEST(ThrustCurve, PropagatesItsUncertaintyAsDrawingManyLinesDoes) {
  const LineUncertainty u = example_uncertainty();
  const ThrustCurve line = line_with(u);
  std::mt19937_64 random(17);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 40000;
  for (const double phi_deg : {2.0, 65.0, 150.0}) {
    for (const ScalingLaw law : {ScalingLaw::clamped, ScalingLaw::published}) {
      const double phi = phi_deg * kPi / 180, angle_error = 0.02;
      if (law == ScalingLaw::clamped && phi_deg == 2.0) continue;  // held at 1 there
      double sum = 0, squares = 0;
      for (int i = 0; i < kDraws; ++i) {
        const double a = normal(random), b = normal(random);
        const double k_t = kExampleCoefficient.value() + u.thrust_coefficient * normal(random);
        const double intercept = line_of(line).intercept.value() + std::sqrt(u.intercept_variance) * a;
        const double slope = line_of(line).slope_per_rad - std::sqrt(u.slope_variance) * (0.8 * a + 0.6 * b);
        const double k = intercept + slope * (phi + angle_error * normal(random));
        const double effective = law == ScalingLaw::published ? k_t - std::fabs(k_t - k) : k;
        sum += effective;
        squares += effective * effective;
      }
      const double mean = sum / kDraws, drawn = std::sqrt(squares / kDraws - mean * mean) / mean;
      // Near K_T the fold of the published law narrows the draws.
      const double tolerance = phi_deg == 2.0 ? 0.25 : 0.03;
      EXPECT_NEAR(line.relative_uncertainty(Radians(phi), Radians(angle_error), law) / drawn, 1.0, tolerance)
          << phi_deg << " degrees";
    }
  }
}

TEST(ThrustCurve, HasTheUncertaintyOfKtWhereTheLawLeavesTheLineAndAnInfiniteOneWhereNoneCanBeGiven) {
  const ThrustCurve line = line_with(example_uncertainty());
  EXPECT_DOUBLE_EQ(line.relative_uncertainty(Radians(0), Radians(0)), 0.01);
  EXPECT_DOUBLE_EQ(line.relative_uncertainty(from_degrees(5), Radians(0.1)), 0.01) << "held at 1";
  EXPECT_NEAR(line.relative_uncertainty(Radians(0), Radians(0), ScalingLaw::published), 0.025 / 0.97, 1e-12);
  EXPECT_EQ(paper_line().relative_uncertainty(from_degrees(65), Radians(0)), kInfinity) << "none is known";
  EXPECT_EQ(line.relative_uncertainty(from_degrees(350), Radians(0)), kInfinity) << "at the floor";
  EXPECT_EQ(line.relative_uncertainty(Radians(kNaN), Radians(0)), kInfinity);
  EXPECT_EQ(line.relative_uncertainty(from_degrees(65), Radians(kNaN)), kInfinity);
}

TEST(ThrustCurve, RefusesAnUncertaintyOrAMeasureThatCannotBe) {
  const auto made = [](const LineUncertainty& u) { return paper_line_if(OverlapMeasure::area_share, u); };
  ASSERT_TRUE(made(example_uncertainty()));
  EXPECT_EQ(made(example_uncertainty())->overlap(), OverlapMeasure::area_share);
  EXPECT_EQ(paper_line().overlap(), OverlapMeasure::rim_arc);
  EXPECT_FALSE(made({-1e-9, 0, 0, 0}));
  EXPECT_FALSE(made({0, -1e-20, 0, 0}));
  EXPECT_FALSE(made({0, 0, kNaN, 0}));
  EXPECT_FALSE(made({0, 0, 0, kInfinity}));
  EXPECT_FALSE(paper_line_if(static_cast<OverlapMeasure>(3), LineUncertainty{}));
}

TEST(ThrustCurve, PerturbedIsRaisedAndScaledAndKeepsTheRest) {
  const ThrustCurve curve = line_with(example_uncertainty());
  const ThrustCoefficient raised = 0.02 * kExampleCoefficient;
  const auto perturbed = curve.perturbed(raised, 1.5);
  ASSERT_TRUE(perturbed);
  const double start = curve.at(Radians(0)).value();
  for (const double phi : {0.0, 0.7, 4.0}) {
    const double expected = start + raised.value() + 1.5 * (curve.at(Radians(phi)).value() - start);
    EXPECT_NEAR(perturbed->at(Radians(phi)).value(), expected, 1e-12 * start) << phi;
    EXPECT_EQ(perturbed->standard_error_at(Radians(phi)), curve.standard_error_at(Radians(phi)));
  }
  EXPECT_EQ(perturbed->thrust_coefficient(), curve.thrust_coefficient());
  EXPECT_EQ(perturbed->largest_fitted(), curve.largest_fitted());
  EXPECT_FALSE(curve.perturbed(-2.0 * kExampleCoefficient, 1)) << "k(0) below 0";
}

TEST(ThrustCurve, StandardErrorIsThatOfTheLineAndInfiniteIfUnknown) {
  const LineUncertainty u = example_uncertainty();
  const ThrustCurve curve = line_with(u);
  EXPECT_DOUBLE_EQ(curve.standard_error_at(Radians(0)), std::sqrt(u.intercept_variance));
  EXPECT_DOUBLE_EQ(curve.standard_error_at(Radians(2)),
                   std::sqrt(u.intercept_variance + 4 * u.covariance + 4 * u.slope_variance));
  EXPECT_EQ(paper_line().standard_error_at(Radians(1)), kInfinity);
}

TEST(ThrustCurveOfATable, GivesTheMeasuredKAndStraightBetween) {
  const ThrustCurve curve = example_table();
  const double k_t = kExampleCoefficient.value();
  EXPECT_EQ(curve.thrust_coefficient(), kExampleCoefficient);
  EXPECT_NEAR(factor(curve, 45, ScalingLaw::clamped), 0.96, 1e-12);
  EXPECT_NEAR(factor(curve, 90, ScalingLaw::clamped), 0.83, 1e-12);
  EXPECT_NEAR(factor(curve, 135, ScalingLaw::published), 0.615, 1e-12);
  EXPECT_EQ(factor(curve, 0, ScalingLaw::clamped), 1);
  EXPECT_NEAR(factor(curve, 350, ScalingLaw::clamped), 0.4 - 0.15 * 170 / 90, 1e-12) << "as between the last two";
  EXPECT_NEAR(curve.at(from_degrees(220)).value() / k_t, 0.4 - 0.15 * 40 / 90, 1e-12);
  EXPECT_EQ(to_degrees(curve.largest_fitted()), 270);
}

TEST(ThrustCurveOfATable, CannotRiseNorStartBelowZero) {
  const auto refused = [](double first, double second) {
    const Knot knots[] = {{Radians(0), first, 0}, {Radians(1), second, 0}};
    const auto table = OcclusionTable::from(knots, 2);
    return !table || !ThrustCurve::from_table(*table, Radians(1));
  };
  EXPECT_FALSE(refused(1, 1));
  EXPECT_TRUE(refused(1, 1.01));
  EXPECT_TRUE(refused(0, 0));
  EXPECT_TRUE(refused(1, -0.1));
  EXPECT_TRUE(refused(kNaN, 1));
  EXPECT_FALSE(ThrustCurve::from_table(OcclusionTable(), Radians(1)));
}

TEST(ThrustCurveOfATable, HasTheUncertaintyOfItsKnotsAndOfItsSlope) {
  const ThrustCurve curve = example_table(0.002);
  ASSERT_TRUE(curve.has_uncertainty());
  EXPECT_FALSE(example_table().has_uncertainty());
  const double k_t = kExampleCoefficient.value();
  EXPECT_NEAR(curve.relative_uncertainty(Radians(0), Radians(0.1)), 0.002, 1e-12) << "k_i is held at 1";
  EXPECT_NEAR(curve.relative_uncertainty(from_degrees(90), Radians(0)), 0.002 / 0.83, 1e-12);
  const double slope = 0.43 / (kPi / 2), between = curve.bend_error_at(from_degrees(135)) / k_t;
  EXPECT_GT(between, 0.001);
  EXPECT_NEAR(curve.relative_uncertainty(from_degrees(135), Radians(0.01)),
              std::hypot(0.002, between, 0.01 * slope) / 0.615, 1e-9);
  EXPECT_EQ(example_table().relative_uncertainty(from_degrees(90), Radians(0)), kInfinity);
}

TEST(ThrustCurveOfATable, PerturbedIsRaisedAndScaled) {
  const ThrustCurve curve = example_table(0.002);
  const auto moved = curve.perturbed(0.02 * kExampleCoefficient, 1.5);
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->thrust_coefficient(), kExampleCoefficient);
  EXPECT_NEAR(moved->at(from_degrees(90)) / kExampleCoefficient, 1.02 - 1.5 * 0.17, 1e-12);
  EXPECT_EQ(moved->standard_error_at(from_degrees(90)), curve.standard_error_at(from_degrees(90)));
  EXPECT_FALSE(curve.perturbed(-2.0 * kExampleCoefficient, 1));
}

TEST(SpeedTrend, FindsTheSpeedThatGivesTheThrust) {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> share(-0.2, 0.2), speed(0, 2300);
  for (int i = 0; i < 100'000; ++i) {
    const SpeedTrend trend{share(random) / 2000, RadPerSec(1500)};
    const double wanted = speed(random), plain = wanted * std::sqrt(trend.factor_at(wanted));
    EXPECT_NEAR(trend.speed_for(plain), wanted, 1e-9 * 2000) << trend.per_rad_s << " " << wanted;
  }
  const SpeedTrend none{0, RadPerSec(1500)};
  for (const double plain : {0.0, 1.0, 1999.9}) EXPECT_EQ(none.speed_for(plain), plain);
}

TEST(SpeedTrend, GivesASpeedThatRisesWithTheThrustWhateverItIs) {
  std::mt19937_64 random(6);
  std::uniform_real_distribution<double> share(-0.3, 0.3), log_reference(0, 5);
  for (int i = 0; i < 500; ++i) {
    const double reference = std::pow(10, log_reference(random));
    const SpeedTrend trend{share(random) / reference, RadPerSec(reference)};
    ThrustCurve curve = paper_line();
    ASSERT_TRUE(curve.set_speed_trend(trend));
    double before = 0;
    for (double plain = 0; plain < 4 * reference; plain += reference / 50) {
      const double speed = trend.speed_for(plain);
      EXPECT_GE(speed, before - 1e-3 * reference) << trend.per_rad_s * reference << " " << plain / reference;
      EXPECT_TRUE(std::isfinite(speed));
      before = speed;
    }
  }
  for (const double odd : {kInfinity, 1e308, 1e-308})
    EXPECT_FALSE(std::isnan(SpeedTrend({1e-4, RadPerSec(1500)}).speed_for(odd)));
}

TEST(SpeedTrend, IsRefusedWhereItCannotBe) {
  ThrustCurve curve = paper_line();
  for (const double odd : {kNaN, kInfinity, -kInfinity, 0.6e-3, -0.6e-3})
    EXPECT_FALSE(curve.set_speed_trend({odd, RadPerSec(1000)})) << odd;
  for (const double odd : {kNaN, kInfinity, 0.0, -1.0}) EXPECT_FALSE(curve.set_speed_trend({0, RadPerSec(odd)})) << odd;
  EXPECT_EQ(curve.speed_trend().per_rad_s, 0);
}

TEST(TorqueShare, IsOneWithoutATableAndRefusedWhereItCannotBe) {
  ThrustCurve curve = paper_line();
  EXPECT_EQ(curve.torque_share_at(Radians(1)), 1);
  const auto set = [&](double share) {
    const Knot knots[] = {{Radians(0), 1}, {Radians(2), share}};
    return curve.set_torque_share(*OcclusionTable::from(knots, 2));
  };
  EXPECT_TRUE(set(0.9));
  EXPECT_NEAR(curve.torque_share_at(Radians(1)), 0.95, 1e-15);
  for (const double odd : {0.0, -0.5, 10.0}) EXPECT_FALSE(set(odd)) << odd;
  EXPECT_NEAR(curve.torque_share_at(Radians(1)), 0.95, 1e-15) << "kept";
  EXPECT_EQ(curve.torque_share_at(Radians(100)), 0.1) << "beyond its last knot it does not turn its sign";
}

TEST(ThrustCurve, IsMadeWithoutExceptions) {
  static_assert(noexcept(ThrustCurve::from_line(ThrustCoefficient(), ThrustCoefficient(), 0.0, Radians())));
  static_assert(noexcept(std::declval<const ThrustCurve&>().scaling_factor(Radians())));
  static_assert(!std::is_default_constructible_v<ThrustCurve>);
}

}  // namespace thrust_curve_test
}  // namespace kphi::compensation
