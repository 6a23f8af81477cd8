#include "drivers/netbox/wire/printable.hpp"

#include <gtest/gtest.h>

namespace kphi::netbox {
namespace {

TEST(Printable, LeavesTextInUtf8AsItIs) {
  for (const std::string text : {"", "Mini40 on Net Box", "Prüfstand φ 90°", "\xF0\x9F\x9B\xA9", "\xC2\xA0"})
    EXPECT_EQ(printable(text), text);
}

TEST(Printable, ReplacesEachByteThatIsNoUtf8) {
  EXPECT_EQ(printable("Pr\xFC"
                      "fstand"),
            "Pr\uFFFDfstand");
  EXPECT_EQ(printable("\xFF\xFE"), "\uFFFD\uFFFD");
  EXPECT_EQ(printable("a\xCF"), "a\uFFFD") << "cut short";
  EXPECT_EQ(printable("\xC0\xAF"), "\uFFFD\uFFFD") << "longer than need be";
  EXPECT_EQ(printable("\xE0\x80\xAF"), "\uFFFD\uFFFD\uFFFD");
  EXPECT_EQ(printable("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD") << "half a surrogate pair";
  EXPECT_EQ(printable("\xF5\x80\x80\x80"), "\uFFFD\uFFFD\uFFFD\uFFFD") << "beyond Unicode";
}

TEST(Printable, ReplacesWhatWouldSteerATerminal) {
  EXPECT_EQ(printable("\x1B[2J"), "\uFFFD[2J");
  EXPECT_EQ(printable("a\nb\x7F"), "a\uFFFDb\uFFFD");
  EXPECT_EQ(printable("\xC2\x9B"
                      "2J"),
            "\uFFFD\uFFFD2J")
      << "a control character in two bytes";
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\uFFFDb");
}

}  // namespace
}  // namespace kphi::netbox
