#include "compensation/file/plausibility.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kphi::compensation {
namespace plausibility_test {

using ::testing::HasSubstr;
using ::testing::Optional;

TEST(Plausibility, KnowsWhatAPropellerPulls) {
  EXPECT_FALSE(doubt_of_thrust(ThrustCoefficient(1.55e-6), 5, 1.2)) << "C_T 0.19";
  EXPECT_FALSE(doubt_of_thrust(ThrustCoefficient(1.55e-6), 0, 1.2)) << "no diameter, no doubt";
  EXPECT_THAT(doubt_of_thrust(ThrustCoefficient(1.7e-8), 5, std::nullopt),
              Optional(HasSubstr("check the unit of k (1 N/RPM^2 = 91.19 N/(rad/s)^2)")));
  EXPECT_THAT(doubt_of_thrust(ThrustCoefficient(1.7e-8), 5, std::nullopt), Optional(HasSubstr("below 0.02")));
  EXPECT_THAT(doubt_of_thrust(ThrustCoefficient(1.55e-6 * 91.19), 5, 1.2), Optional(HasSubstr("above 0.4")));
}

TEST(Plausibility, KnowsRadiansWhenItSeesThem) {
  EXPECT_THAT(doubt_of_angles({0, 0.7854, 1.5708, 3.1416, 4.7124}), Optional(HasSubstr("4.712 rad = 270°")));
  EXPECT_FALSE(doubt_of_angles({0, 45, 90, 180, 270}));
  EXPECT_FALSE(doubt_of_angles({0, 1, 2, 5})) << "small plates";
  EXPECT_FALSE(doubt_of_angles({0, 0.5, 90}));
  EXPECT_FALSE(doubt_of_angles({}));
}

}  // namespace plausibility_test
}  // namespace kphi::compensation
