#include "daq/run/sequence.hpp"

#include <gtest/gtest.h>

namespace kphi::daq {
namespace sequence_test {

using std::chrono::milliseconds;

TEST(Slew, GoesStraightAndNoFasterThanItsRate) {
  const Slew slew(RadPerSec(100), RadPerSec(300), 400.0);
  EXPECT_EQ(slew.lasts(), milliseconds(500));
  EXPECT_EQ(slew.at(Duration(0)), RadPerSec(100));
  EXPECT_NEAR(slew.at(milliseconds(250)).value(), 200, 1e-9);
  EXPECT_EQ(slew.at(milliseconds(500)), RadPerSec(300));
  EXPECT_EQ(slew.at(std::chrono::hours(1)), RadPerSec(300));
}

TEST(Slew, GoesDownLikewise) {
  const Slew slew(RadPerSec(300), RadPerSec(100), 400.0);
  EXPECT_EQ(slew.lasts(), milliseconds(500));
  EXPECT_NEAR(slew.at(milliseconds(125)).value(), 250, 1e-9);
}

TEST(Slew, TakesNoTimeWithoutARateOrWithoutAChange) {
  EXPECT_EQ(Slew(RadPerSec(0), RadPerSec(2000), std::nullopt).lasts(), Duration(0));
  EXPECT_EQ(Slew(RadPerSec(0), RadPerSec(2000), std::nullopt).at(Duration(0)), RadPerSec(2000));
  EXPECT_EQ(Slew(RadPerSec(5), RadPerSec(5), 1.0).lasts(), Duration(0));
}

}  // namespace sequence_test
}  // namespace kphi::daq
