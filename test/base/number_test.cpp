#include "base/number.hpp"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace kphi::number_test {

TEST(ParseDouble, TakesTheWholeTextOrNothing) {
  EXPECT_EQ(parse_double("1.5e3"), 1500);
  EXPECT_EQ(parse_double("-0.25"), -0.25);
  EXPECT_TRUE(std::isnan(parse_double("nan").value()));
  for (const char* text : {"", " 1", "1 ", "+1", "1,5", "0x10", "1e999", "1.2.3", "-"})
    EXPECT_FALSE(parse_double(text)) << text;
  EXPECT_FALSE(parse_double({}));
}

TEST(ParseFinite, RefusesNanAndInfinities) {
  EXPECT_EQ(parse_finite("2"), 2);
  for (const char* text : {"nan", "inf", "-inf", "", "x"}) EXPECT_FALSE(parse_finite(text)) << text;
}

TEST(ParseInteger, HoldsTheRangeOfItsType) {
  EXPECT_EQ(parse_integer<std::uint16_t>("65535"), 65535);
  EXPECT_EQ(parse_integer<int>("-7"), -7);
  for (const char* text : {"", "-1", "+1", " 1", "1 ", "1.0", "0x1", "99999999999"})
    EXPECT_FALSE(parse_integer<unsigned>(text)) << text;
  EXPECT_EQ(parse_integer<std::uint16_t>("dd", 16), 0xdd);
  EXPECT_FALSE(parse_integer<std::uint16_t>("65536"));
  EXPECT_FALSE(parse_integer<unsigned>("-1"));
  for (const char* text : {"", " 1", "1 ", "+1", "1.0", "0x1", "a"}) EXPECT_FALSE(parse_integer<int>(text)) << text;
}

TEST(Shortest, ReadsBackAsTheSameBits) {
  for (const double value : {45.0, 1e-6, 0.1, 1.0 / 3, -2.5e300, std::numeric_limits<double>::denorm_min()})
    EXPECT_EQ(parse_double(shortest(value)), value);
}

TEST(YamlNumber, LooksLikeAFloatToEveryReader) {
  EXPECT_EQ(yaml_number(45), "45.0");
  EXPECT_EQ(yaml_number(0), "0.0");
  EXPECT_EQ(yaml_number(1e-6), "1.0e-06");
  EXPECT_EQ(yaml_number(1.35e-6), "1.35e-06");
  EXPECT_EQ(yaml_number(1e300), "1.0e+300");
  EXPECT_EQ(yaml_number(-0.5), "-0.5");
}

TEST(YamlNumber, RefusesWhatIsNoNumber) {
  EXPECT_THROW((void)yaml_number(std::nan("")), std::invalid_argument);
  EXPECT_THROW((void)yaml_number(std::numeric_limits<double>::infinity()), std::invalid_argument);
}

TEST(Number, OfAnyMagnitudeReadsBackAsTheSameBits) {
  EXPECT_TRUE(rc::check([](std::uint64_t bits) {
    const double value = std::bit_cast<double>(bits);
    RC_PRE(std::isfinite(value));
    RC_ASSERT(std::bit_cast<std::uint64_t>(*parse_double(shortest(value))) == bits);
    const std::string yaml = yaml_number(value);
    RC_ASSERT(std::bit_cast<std::uint64_t>(*parse_double(yaml)) == bits);
    RC_ASSERT(yaml.find('.') != std::string::npos && yaml.find('.') < yaml.find('e'));
  }));
}

}  // namespace kphi::number_test
