#include "base/csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "base/error.hpp"
#include "fit/logs/k_table.hpp"
#include "fit/logs/rcbenchmark_csv.hpp"
#include "fit/logs/uiuc_table.hpp"

namespace kphi::fit {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(Csv, TakesByteOrderMarkCarriageReturnsAndTrailingCommas) {
  const Table table = read_csv(
      "\xEF\xBB\xBF"
      "a,b,\r\n1,2,\r\n\r\n3,,",
      "t.csv");
  EXPECT_THAT(table.header, ElementsAre("a", "b"));
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_THAT(table.rows[0].fields, ElementsAre("1", "2"));
  EXPECT_THAT(table.rows[1].fields, ElementsAre("3", ""));
  EXPECT_EQ(table.rows[1].line, 4u);
  EXPECT_TRUE(table.problems.empty());
}

TEST(Csv, ReportsLinesWithTooManyOrTooFewFields) {
  const Table table = read_csv("a,b\n1,2,3\n1\n4,5\n", "t.csv");
  ASSERT_EQ(table.rows.size(), 1u);
  ASSERT_EQ(table.problems.size(), 2u);
  EXPECT_EQ(table.problems[0].line, 2u);
  EXPECT_THAT(table.problems[0].what, HasSubstr("3 fields where the header has 2"));
  EXPECT_EQ(table.problems[1].line, 3u);
}

TEST(Csv, ReadsQuotedFields) {
  const Table table = read_csv("a,b\n\"1,5\",\"say \"\"hi\"\"\"\n\"open,2\n\"x\"y,2\n", "t.csv");
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_THAT(table.rows[0].fields, ElementsAre("1,5", "say \"hi\""));
  EXPECT_EQ(table.problems.size(), 2u);
}

TEST(Csv, FindsColumnsByNameInAnyOrder) {
  const Table table = read_csv("b,a,b\n", "t.csv");
  EXPECT_EQ(table.column("a"), 1u);
  EXPECT_THROW((void)table.column("c"), ConfigurationError);
  EXPECT_THROW((void)table.column("b"), ConfigurationError) << "which of the two?";
}

TEST(Csv, ReadsBlankSeparatedTables) {
  const Table table = read_blank_separated("RPM  CT\tCP\r\n 1490.000 0.1  0.2 \r\n", "t.txt");
  EXPECT_THAT(table.header, ElementsAre("RPM", "CT", "CP"));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_THAT(table.rows[0].fields, ElementsAre("1490.000", "0.1", "0.2"));
}

TEST(Csv, NumbersAreWholeFiniteFields) {
  EXPECT_EQ(parse_number(" 1.5e-6 "), 1.5e-6);
  for (const char* bad : {"", " ", "1.5x", "1,5", "nan", "inf", "1e999", "0x10", "--1"})
    EXPECT_FALSE(parse_number(bad)) << bad;
}

TEST(KTable, ReadsCoefficientsInBothUnits) {
  const auto si = read_k_table("phi_deg,k,u_k\n0,1.55e-6,1e-9\n45,1.4e-6,2e-9\n", "K.csv");
  ASSERT_EQ(si.size(), 2u);
  EXPECT_EQ(si[1].k, 1.4e-6);
  EXPECT_EQ(si[1].standard_error, 2e-9);
  const auto rpm = read_k_table("phi_deg,k_n_per_rpm2\n0,1.7e-8\n", "K.csv");
  EXPECT_NEAR(rpm[0].k, 1.7e-8 * 91.189065, 1e-12);
  EXPECT_EQ(rpm[0].standard_error, 0);
}

TEST(KTable, NamesTheLineThatIsWrong) {
  for (const char* bad : {"phi_deg\n0\n", "k\n1\n", "phi_deg,k\n0\n", "phi_deg,k\n0,x\n", "phi_deg,k\n400,1e-6\n",
                          "phi_deg,k\n0,-1e-6\n", ""}) {
    EXPECT_THROW((void)read_k_table(bad, "K.csv"), ConfigurationError) << bad;
  }
  try {
    (void)read_k_table("phi_deg,k\n0,1e-6\n45,abc\n", "K.csv");
    FAIL();
  } catch (const ConfigurationError& error) {
    EXPECT_THAT(error.what(), HasSubstr("K.csv:3"));
  }
  EXPECT_TRUE(is_k_table("phi_deg,k\n"));
  EXPECT_FALSE(is_k_table("propeller,blades\n"));
}

TEST(Csv, NoMutationOfATableCrashesAReader) {
  const std::string seeds[] = {
      "\xEF\xBB\xBFTime (s),ESC (µs),Thrust (gf),Motor Electrical Speed (RPM),Motor Optical Speed (RPM),App message,\n"
      "0,1050,6.07,0,0,,\n2.2,1145,14.6,3853,0,\"a,b\",\n3.9,1240,29.2,5196,0,,\n",
      "RPM CT CP\r\n1490.0 0.11 0.05\r\n3000 0.12 0.06\r\n", "phi_deg,k,u_k\n0,1.55e-6,1e-9\n45,1.4e-6,2e-9\n"};
  std::mt19937 random(42);
  std::size_t accepted = 0, refused = 0;
  for (int trial = 0; trial < 30000; ++trial) {
    std::string text = seeds[trial % 3];
    const int edits = 1 + static_cast<int>(random() % 6);
    for (int i = 0; i < edits && !text.empty(); ++i) {
      const std::size_t at = random() % text.size();
      const char bytes[] = {',', '"', '\n', '\r', ' ', '\0', '-', 'e', '9', static_cast<char>(random())};
      switch (random() % 4) {
        case 0:
          text[at] = bytes[random() % 10];
          break;
        case 1:
          text.insert(at, 1, bytes[random() % 10]);
          break;
        case 2:
          text.erase(at, 1 + random() % 4);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 40));
          break;
      }
    }
    try {
      switch (trial % 3) {
        case 0:
          accepted += select_rows(read_rcbenchmark(text, "x.csv")).steps.size();
          break;
        case 1:
          accepted += read_uiuc(text, "apc_5x4_x.txt").steps.size();
          break;
        default:
          accepted += read_k_table(text, "K.csv").size();
          break;
      }
    } catch (const ConfigurationError&) {
      ++refused;
    }
  }
  EXPECT_GT(accepted, 0u);
  EXPECT_GT(refused, 0u);
}

}  // namespace
}  // namespace kphi::fit
