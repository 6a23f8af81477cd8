#include "compensation/flight/loss_law.hpp"

#include <gtest/gtest.h>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

constexpr LossLaw kLaws[] = {LossLaw::quadratic, LossLaw::quadratic_by_load, LossLaw::steep_onset};

TEST(LossLaw, GoesThroughWhatThePaperMeasured) {
  EXPECT_EQ(thrust_share(LossLaw::quadratic, 0), 1);
  EXPECT_NEAR(thrust_share(LossLaw::quadratic, 45), 0.90, 1e-4);
  EXPECT_NEAR(thrust_share(LossLaw::quadratic, 270), 0.25, 1e-4);
  EXPECT_EQ(thrust_share(LossLaw::steep_onset, 0), 1);
  EXPECT_NEAR(thrust_share(LossLaw::steep_onset, 45), 0.84, 0.005);
  EXPECT_NEAR(thrust_share(LossLaw::steep_onset, 270), 0.25, 1e-6);
}

TEST(LossLaw, FallsWithOcclusionAndIsNeverTheControllersLine) {
  const compensation::ThrustCurve line = compensation::paper_line();
  for (const LossLaw law : kLaws) {
    double largest_difference = 0;
    for (double degrees = 1; degrees <= 270; ++degrees) {
      EXPECT_LT(thrust_share(law, degrees), thrust_share(law, degrees - 1)) << name_of(law) << " " << degrees;
      const double believed = line.scaling_factor(from_degrees(degrees));
      largest_difference = std::max(largest_difference, std::fabs(thrust_share(law, degrees) - believed));
    }
    EXPECT_GT(largest_difference, 0.02) << name_of(law);
  }
}

TEST(LossLaw, LosesGammaTimesAsMuchInFlight) {
  const Shadow& shadow = example_shadow();
  const Radians o = from_degrees(180);
  for (const LossLaw law : kLaws) {
    const double bench = thrust_share_in_flight(law, 1, shadow, 0, o);
    EXPECT_LT(bench, 0.95);
    EXPECT_NEAR(1 - thrust_share_in_flight(law, 1.4, shadow, 0, o), 1.4 * (1 - bench), 1e-12);
    EXPECT_EQ(thrust_share_in_flight(law, 100, shadow, 0, o), 0.05);
    EXPECT_EQ(thrust_share_in_flight(law, 1.4, shadow, 0, from_degrees(45)), 1) << "nothing is lost in X";
  }
}

}  // namespace
}  // namespace kphi::flight
