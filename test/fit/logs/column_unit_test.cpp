#include "fit/logs/column_unit.hpp"

#include <gtest/gtest.h>

namespace kphi::fit {
namespace {

TEST(ColumnUnit, StandsInBracketsOfEitherKind) {
  EXPECT_EQ(split_header("Motor Optical Speed (RPM)").name, "Motor Optical Speed");
  EXPECT_EQ(split_header("Motor Optical Speed (RPM)").unit, "RPM");
  EXPECT_EQ(split_header("Kraft [kgf]").unit, "kgf");
  EXPECT_EQ(split_header("thrust (raw) [N]").name, "thrust (raw)");
  EXPECT_EQ(split_header("plain").unit, "");
  EXPECT_EQ(split_header("").name, "");
}

TEST(ColumnUnit, MayStandBehindAnUnderscore) {
  EXPECT_EQ(unit_suffix("speed_rad_s", Measure::speed), "rad_s");
  EXPECT_EQ(unit_suffix("thrust_n", Measure::thrust), "n");
  EXPECT_EQ(unit_suffix("thrust_mean", Measure::thrust), "");
}

TEST(ColumnUnit, ConvertsExactly) {
  EXPECT_DOUBLE_EQ(*unit_factor(Measure::thrust, "gf"), 9.80665e-3);
  EXPECT_DOUBLE_EQ(*unit_factor(Measure::thrust, "lbf"), 4.4482216152605);
  EXPECT_DOUBLE_EQ(*unit_factor(Measure::thrust, "ozf") * 16, *unit_factor(Measure::thrust, "lbf"));
  EXPECT_NEAR(*unit_factor(Measure::speed, "rad/s"), 9.549296585513721, 1e-14);
  EXPECT_DOUBLE_EQ(*unit_factor(Measure::torque, "lbf·ft"), 4.4482216152605 * 0.3048);
}

TEST(ColumnUnit, DoesNotTakeTheUnitOfAnotherMeasure) {
  EXPECT_FALSE(unit_factor(Measure::thrust, "RPM"));
  EXPECT_FALSE(unit_factor(Measure::thrust, ""));
  EXPECT_FALSE(unit_factor(Measure::thrust, "MN"));
}

}  // namespace
}  // namespace kphi::fit
