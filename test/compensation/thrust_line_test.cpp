#include "compensation/thrust_line.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <type_traits>
#include <utility>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double factor(const ThrustLine& line, double phi_deg, ScalingLaw law) {
  return line.scaling_factor(from_degrees(phi_deg), law);
}

TEST(ThrustLine, GivesTheScalingFactorsAndSpeedRatiosOfThePapersLine) {
  const ThrustLine line = paper_line();
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

TEST(ThrustLine, PublishedLawReflectsWhereTheLineLiesAboveTheThrustCoefficient) {
  const ThrustLine line = paper_line();
  EXPECT_NEAR(factor(line, 0, ScalingLaw::published), 0.97, 1e-12);
  EXPECT_NEAR(factor(line, 10.384, ScalingLaw::published), 1.0, 1e-5);
  EXPECT_LT(factor(line, 5, ScalingLaw::published), 1.0);
}

TEST(ThrustLine, PublishedLawDivergesNear356DegreesAndGoesNegativeBeyond) {
  const ThrustLine line = paper_line();
  EXPECT_NEAR(1 / std::sqrt(factor(line, 356, ScalingLaw::published)), 25.0, 1.5);
  EXPECT_LT(factor(line, 358, ScalingLaw::published), 0.0);
}

TEST(ThrustLine, ClampedLawIsExactlyOneWithoutOcclusionWhateverTheIntercept) {
  for (const double intercept : {0.9, 1.0, 1.03}) {
    const ThrustLine line = example_line(intercept, -0.0028889);
    EXPECT_EQ(line.scaling_factor(Radians(0)), 1.0);
    EXPECT_EQ(line.scaling_factor(Radians(-0.0)), 1.0);
  }
}

TEST(ThrustLine, ClampedLawNeverSlowsAPropellerDownNorGoesBelowTheFloor) {
  const ThrustLine line = paper_line();
  EXPECT_EQ(factor(line, 5, ScalingLaw::clamped), 1.0);
  EXPECT_EQ(factor(line, 340, ScalingLaw::clamped), kScalingFloor);
  EXPECT_EQ(factor(line, 360, ScalingLaw::clamped), kScalingFloor);
}

TEST(ThrustLine, ClampedLawStaysInRangeForAnyLineAndAngle) {
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> intercept(1e-3, 3), slope(-0.1, 0.1), phi(-10, 400);
  for (int i = 0; i < 100000; ++i) {
    const ThrustLine line = example_line(intercept(random), slope(random));
    const double k = factor(line, phi(random), ScalingLaw::clamped);
    ASSERT_GE(k, kScalingFloor);
    ASSERT_LE(k, 1.0);
  }
  for (const double odd : {kNaN, kInfinity, -kInfinity, 1e308}) {
    const double k = paper_line().scaling_factor(Radians(odd));
    EXPECT_GE(k, kScalingFloor);
    EXPECT_LE(k, 1.0);
  }
}

TEST(ThrustLine, FactorFallsMonotonicallyWithOcclusion) {
  const ThrustLine line = paper_line();
  for (double phi = 0; phi < 360; phi += 0.25) {
    EXPECT_GE(factor(line, phi, ScalingLaw::clamped), factor(line, phi + 0.25, ScalingLaw::clamped));
  }
}

TEST(ThrustLine, AtIsTheLineItself) {
  const ThrustLine line = paper_line();
  EXPECT_DOUBLE_EQ(line.at(Radians(0)) / line.thrust_coefficient(), 1.03);
  EXPECT_NEAR(line.at(from_degrees(356.5371)) / line.thrust_coefficient(), 0.0, 1e-6);
}

TEST(ThrustLine, CannotExistInvalid) {
  const ThrustCoefficient k(1.55e-6);
  const Radians reach(4.7);
  EXPECT_TRUE(ThrustLine::from(k, k, -1e-7, reach));
  EXPECT_TRUE(ThrustLine::from(k, k, +1e-7, reach)) << "no loss is odd, not invalid";
  for (const double bad : {kNaN, kInfinity, -kInfinity, 0.0, -1e-6}) {
    EXPECT_FALSE(ThrustLine::from(ThrustCoefficient(bad), k, -1e-7, reach)) << bad;
    EXPECT_FALSE(ThrustLine::from(k, ThrustCoefficient(bad), -1e-7, reach)) << bad;
    EXPECT_FALSE(ThrustLine::from(k, k, -1e-7, Radians(bad))) << bad;
  }
  for (const double bad : {kNaN, kInfinity, -kInfinity}) EXPECT_FALSE(ThrustLine::from(k, k, bad, reach)) << bad;
  EXPECT_FALSE(ThrustLine::from(k, k, -1e-7, Radians(6.3)));
}

TEST(ThrustLine, IsMadeWithoutExceptions) {
  static_assert(noexcept(ThrustLine::from(ThrustCoefficient(), ThrustCoefficient(), 0.0, Radians())));
  static_assert(noexcept(std::declval<const ThrustLine&>().scaling_factor(Radians())));
  static_assert(!std::is_default_constructible_v<ThrustLine>);
}

}  // namespace
}  // namespace kphi::compensation
