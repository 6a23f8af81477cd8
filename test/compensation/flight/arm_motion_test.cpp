#include "compensation/flight/arm_motion.hpp"

#include <gtest/gtest.h>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

const double kMorphSeconds = example_build().morph_s;

TEST(ArmMotion, RestsWhereItBegan) {
  const Vehicle vehicle = example_vehicle();
  const ArmMotion motion(vehicle.x, kMorphSeconds);
  EXPECT_FALSE(motion.moving(0));
  EXPECT_EQ(motion.angles(0), vehicle.x);
  EXPECT_EQ(motion.rates(3), (std::array<double, 4>{}));
}

TEST(ArmMotion, ArrivesExactlyAfterTheStatedTimeFromRestToRest) {
  const Vehicle vehicle = example_vehicle();
  ArmMotion motion(vehicle.x, kMorphSeconds);
  motion.begin(vehicle.o, 2.0);
  EXPECT_EQ(motion.angles(2.0), vehicle.x);
  EXPECT_TRUE(motion.moving(2.0 + kMorphSeconds - 1e-9));
  EXPECT_FALSE(motion.moving(2.0 + kMorphSeconds));
  EXPECT_EQ(motion.angles(2.0 + kMorphSeconds), vehicle.o);
  EXPECT_EQ(motion.rates(2.0)[0], 0.0);
  EXPECT_NEAR(motion.rates(2.0 + kMorphSeconds - 1e-6)[0], 0.0, 1e-9);
  EXPECT_NEAR(motion.angles(2.0 + kMorphSeconds / 2)[0].value(), from_degrees(112.5).value(), 1e-12) << "half way";
}

TEST(ArmMotion, RatesAreTheDerivativeOfTheAngles) {
  const Vehicle vehicle = example_vehicle();
  ArmMotion motion(vehicle.x, kMorphSeconds);
  motion.begin(vehicle.o, 0);
  for (double t = 0.1; t < kMorphSeconds; t += 0.1) {
    for (std::size_t i = 0; i < 4; ++i) {
      const double slope = (motion.angles(t + 1e-5)[i] - motion.angles(t - 1e-5)[i]).value() / 2e-5;
      EXPECT_NEAR(motion.rates(t)[i], slope, 1e-6);
      EXPECT_GT(motion.rates(t)[i], 0) << "arms move one way";
    }
  }
}

}  // namespace
}  // namespace kphi::flight
