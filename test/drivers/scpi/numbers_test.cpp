#include "drivers/scpi/numbers.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace kphi::scpi {
namespace {

TEST(ScpiNumbers, ReadsEveryFormOfTheStandard) {
  EXPECT_EQ(number_of("12"), 12.0);
  EXPECT_EQ(number_of("+12.50"), 12.5);
  EXPECT_EQ(number_of("-1.2E-3"), -1.2e-3);
  EXPECT_EQ(number_of(" 1.234E+01\r"), 12.34);
  EXPECT_EQ(number_of("0"), 0.0) << "a value, not an absence";
}

TEST(ScpiNumbers, RefusesWhatIsNone) {
  for (const char* text :
       {"", " ", "12V", "1,2", "0x10", "nan", "inf", "9.9E37", "9.91E37", "-9.9E37", "+-1", "1e400", "1 2"})
    EXPECT_FALSE(number_of(text).has_value()) << text;
}

TEST(ScpiNumbers, WritesWhatWasMeant) {
  EXPECT_EQ(number_text(12, 0.001), "12.000");
  EXPECT_EQ(number_text(1.13, 0.01), "1.13");
  EXPECT_EQ(number_text(0, 0.001), "0.000");
  for (int centivolts = 0; centivolts <= 6000; ++centivolts)
    ASSERT_EQ(std::llround(100 * *number_of(number_text(centivolts / 100.0, 0.01))), centivolts);
}

}  // namespace
}  // namespace kphi::scpi
