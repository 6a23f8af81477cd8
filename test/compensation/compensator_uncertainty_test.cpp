// How well a speed is known.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(CompensatorUncertainty, TellsTheUncertaintyOfItsSpeeds) {
  const ThrustCurve rim = paper_line();
  const double k = kExampleCoefficient.value();
  const LineUncertainty u{0.01 * k, 0.0004 * k * k, 0, 0};
  const ThrustCurve line =
      *ThrustCurve::from_line(rim.thrust_coefficient(), rim.line().intercept, rim.line().slope_per_rad,
                              rim.largest_fitted(), OverlapMeasure::rim_arc, u);
  Compensator compensator = *Compensator::build({line, line, line, rim}, example_airframe()).compensator;
  const auto thrusts = thrusts_of(1.5, 1.5, 1.5, 1.5);
  compensator.set_arms(arms_at(45, 180, 180, 180));
  const auto speeds = compensator.speeds_for(thrusts).speeds;
  const auto exact_arms = compensator.speed_uncertainties(thrusts);
  EXPECT_NEAR(exact_arms[0] / speeds[0], 0.005, 1e-12) << "half of K_T's";
  EXPECT_NEAR(exact_arms[1] / speeds[1], 0.5 * 0.02 / compensator.scaling_factors()[1], 1e-12) << "half of the line's";
  EXPECT_EQ(exact_arms[3].value(), kInfinity) << "the line carries none";

  // A degree of servo play moves φ by 1.5 to 1.84 degrees in O.
  const auto loose_arms = compensator.speed_uncertainties(thrusts, from_degrees(1));
  const double from_phi = std::sqrt(std::pow(loose_arms[1] / speeds[1], 2) - std::pow(exact_arms[1] / speeds[1], 2));
  EXPECT_NEAR(2 * from_phi * compensator.scaling_factors()[1] / 0.0028889, 1.7, 0.2);
  EXPECT_EQ(loose_arms[0], exact_arms[0]) << "far from contact the arm does not matter";

  compensator.enable(false);
  const auto off = compensator.speed_uncertainties(thrusts, from_degrees(1));
  EXPECT_NEAR(off[1] / compensator.speeds_for(thrusts).speeds[1], 0.005, 1e-12);
  compensator.enable(true);
  compensator.set_arms(arms_at(45, std::nan(""), 180, 180));
  EXPECT_EQ(compensator.speed_uncertainties(thrusts)[1].value(), kInfinity) << "the arm is anywhere";
  for (const RadPerSec none : compensator.speed_uncertainties(thrusts, Radians(kNaN))) {
    EXPECT_EQ(none.value(), kInfinity);
  }
}

}  // namespace
}  // namespace kphi::compensation
