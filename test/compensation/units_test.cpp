#include "compensation/units.hpp"

#include <gtest/gtest.h>

#include <type_traits>

namespace kphi {
namespace units_test {

TEST(Units, ConversionsReturnWhereTheyCameFrom) {
  for (const double number : {-270.0, 0.0, 1e-8, 17.188, 19100.0}) {
    EXPECT_DOUBLE_EQ(to_rpm(from_rpm(number)), number);
    EXPECT_DOUBLE_EQ(to_degrees(from_degrees(number)), number);
    EXPECT_DOUBLE_EQ(to_newtons_per_rpm2(from_newtons_per_rpm2(number)), number);
  }
}

TEST(Units, OfThePaperAreThoseOfSi) {
  EXPECT_NEAR(from_newtons_per_rpm2(1.0).value(), 91.19, 0.005);
  EXPECT_NEAR(from_rpm(19100).value(), 2000.0, 0.2);
  EXPECT_NEAR(from_rpm(17188).value(), 1800.0, 0.1);
  EXPECT_EQ(from_gram_force(1000).value(), 9.80665) << "exactly";
  EXPECT_NEAR(thrust_at(from_newtons_per_rpm2(0.5e-8), from_rpm(17188)).value(), 1.48, 0.005);
  EXPECT_NEAR(thrust_at(ThrustCoefficient(0.5e-8), from_rpm(17188)).value(), 0.016, 0.0005) << "not N/RPM²";
}

TEST(Units, DifferentUnitsDoNotMix) {
  static_assert(!std::is_convertible_v<double, Newtons>);
  static_assert(!std::is_convertible_v<Newtons, double>);
  static_assert(!std::is_constructible_v<Newtons, RadPerSec>);
  EXPECT_EQ((Newtons(3) - Newtons(1)) / Newtons(4), 0.5);
}

}  // namespace units_test
}  // namespace kphi
