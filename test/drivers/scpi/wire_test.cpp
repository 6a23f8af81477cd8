#include "drivers/scpi/wire.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

namespace kphi::scpi {
namespace wire_test {

TEST(ScpiNumbers, ReadsEveryFormOfTheStandard) {
  EXPECT_EQ(number_of("12"), 12.0);
  EXPECT_EQ(number_of("+12.50"), 12.5);
  EXPECT_EQ(number_of("-1.2E-3"), -1.2e-3);
  EXPECT_EQ(number_of(" 1.234E+01\r"), 12.34);
  EXPECT_EQ(number_of("0"), 0.0) << "a value, not an absence";
}

TEST(ScpiNumbers, RefusesWhatIsNotANumber) {
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

using namespace usbtmc;
using testing::ElementsAre;
using testing::ElementsAreArray;

TEST(UsbtmcHeader, WrapsAMessageInTheBytesOfTheStandard) {
  const std::uint8_t expected[] = {0x01, 0x01, 0xFE, 0x00, 0x06, 0x00, 0x00, 0x00, 0x01, 0x00,
                                   0x00, 0x00, 0x2A, 0x49, 0x44, 0x4E, 0x3F, 0x0A, 0x00, 0x00};
  EXPECT_THAT(message_out(1, "*IDN?\n"), ElementsAreArray(expected));
}

TEST(UsbtmcHeader, AsksForAnAnswerInTheBytesOfTheStandard) {
  EXPECT_THAT(request_in(2, 1024), ElementsAre(0x02, 0x02, 0xFD, 0x00, 0x00, 0x04, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00));
}

TEST(UsbtmcHeader, PadsToMultiplesOfFour) {
  for (std::size_t n = 0; n < 20; ++n) {
    const auto bytes = message_out(7, std::string(n, 'x'));
    EXPECT_EQ(bytes.size() % 4, 0u);
    EXPECT_EQ(bytes[4], n) << "the size is that of the text alone";
    EXPECT_LT(bytes.size() - kHeaderBytes - n, 4u);
  }
}

TEST(UsbtmcHeader, NeverUsesTagZero) {
  std::uint8_t tag = 0;
  for (int i = 0; i < 1000; ++i) {
    tag = next_tag(tag);
    ASSERT_NE(tag, 0);
  }
  EXPECT_EQ(next_tag(255), 1);
}

TEST(UsbtmcHeader, TakesOnlyTheAnswerToItsOwnTag) {
  const std::array<std::uint8_t, 12> good{2, 9, 0xF6, 0, 3, 1, 0, 0, 1, 0, 0, 0};
  const auto header = answer_header(good, 9);
  ASSERT_TRUE(header.has_value());
  EXPECT_EQ(header->bytes, 259u);
  EXPECT_TRUE(header->end_of_message);
  EXPECT_FALSE(answer_header(good, 8).has_value());
  auto bad = good;
  bad[2] = 9;
  EXPECT_FALSE(answer_header(bad, 9).has_value()) << "complement";
  bad = good;
  bad[0] = 1;
  EXPECT_FALSE(answer_header(bad, 9).has_value()) << "kind of message";
  EXPECT_FALSE(answer_header(std::span(good).first(11), 9).has_value());
}

TEST(ScpiIdentity, IsFourFieldsOrFewer) {
  EXPECT_THAT(identity_fields("RIGOL TECHNOLOGIES,DP832,DP8A1,00.01.14"),
              ElementsAre("RIGOL TECHNOLOGIES", "DP832", "DP8A1", "00.01.14"));
  EXPECT_THAT(identity_fields("KPHI,PS30"), ElementsAre("KPHI", "PS30", "", ""));
  EXPECT_THAT(identity_fields(""), ElementsAre("", "", "", ""));
}

}  // namespace wire_test
}  // namespace kphi::scpi
