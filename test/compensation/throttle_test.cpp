#include "compensation/throttle.hpp"

#include <gtest/gtest.h>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace throttle_test {

TEST(Throttle, InvertsTheThrustCurveOfAnyCurvature) {
  for (const double share : {0.0, 1e-9, 0.3, 0.7, 1.0}) {
    const ThrottleCurve curve{Newtons(6), share};
    for (double u = 0; u <= 1; u += 1.0 / 64) {
      EXPECT_NEAR(curve.throttle_for(Newtons(6 * (share * u * u + (1 - share) * u))), u, 1e-12);
    }
  }
}

TEST(Throttle, StaysBetweenNothingAndAll) {
  const ThrottleCurve curve{Newtons(6), 0.5};
  for (const double thrust : {0.0, -1.0, kNaN, -kInfinity}) EXPECT_EQ(curve.throttle_for(Newtons(thrust)), 0);
  for (const double thrust : {6.0, 7.0, kInfinity}) EXPECT_EQ(curve.throttle_for(Newtons(thrust)), 1);
}

TEST(Throttle, AskedForTheUncoveredThrustTurnsTheRotorAsTheSpeedLoopWould) {
  const Compensator compensator = with_arms(shape_o());
  const auto thrusts = thrusts_of(1, 1.5, 2, 100);
  const auto uncovered = compensator.uncovered_thrusts(thrusts);
  const auto speeds = compensator.speeds_for(thrusts).speeds;
  for (std::size_t i = 0; i < 4; ++i) {
    // T ~ u² is T ~ ω²: throttle is the share of the fastest speed.
    const double full = kExampleCoefficient.value() * std::pow(example_airframe().fastest_speed.value(), 2);
    const double throttle = ThrottleCurve{Newtons(full), 1}.throttle_for(uncovered[i]);
    EXPECT_NEAR(throttle, speeds[i] / example_airframe().fastest_speed, 1e-12);
  }
  EXPECT_EQ(compensator.uncovered_thrusts(thrusts_of(kNaN, -1, 0, 1))[0].value(), 0);
}

}  // namespace throttle_test
}  // namespace kphi::compensation
