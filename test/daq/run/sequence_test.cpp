#include "daq/run/sequence.hpp"

#include <gtest/gtest.h>

namespace kphi::daq {
namespace sequence_test {

using std::chrono::milliseconds;

TEST(Slew, GoesStraightAndNoFasterThanItsRateUpAndDown) {
  for (const auto& [from, to] : {std::pair(100.0, 300.0), std::pair(300.0, 100.0)}) {
    const Slew slew(RadPerSec(from), RadPerSec(to), 400.0);
    EXPECT_EQ(slew.lasts(), milliseconds(500));
    EXPECT_EQ(slew.at(Duration(0)), RadPerSec(from));
    EXPECT_NEAR(slew.at(milliseconds(125)).value(), 0.75 * from + 0.25 * to, 1e-9);
    EXPECT_EQ(slew.at(milliseconds(500)), RadPerSec(to));
    EXPECT_EQ(slew.at(std::chrono::hours(1)), RadPerSec(to));
  }
}

TEST(Slew, TakesNoTimeWithoutARateOrWithoutAChange) {
  EXPECT_EQ(Slew(RadPerSec(0), RadPerSec(2000), std::nullopt).lasts(), Duration(0));
  EXPECT_EQ(Slew(RadPerSec(0), RadPerSec(2000), std::nullopt).at(Duration(0)), RadPerSec(2000));
  EXPECT_EQ(Slew(RadPerSec(5), RadPerSec(5), 1.0).lasts(), Duration(0));
}

}  // namespace sequence_test
}  // namespace kphi::daq
