#include "fit/logs/mapped_csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "fit/logs/import_table.hpp"

namespace kphi::fit {
namespace {

using ::testing::HasSubstr;

std::vector<ColumnRole> roles(std::initializer_list<const char*> texts) {
  std::vector<ColumnRole> columns;
  for (const char* text : texts) columns.push_back(parse_column_role(text));
  return columns;
}

template <class Work>
std::string refusal(Work work) {
  try {
    (void)work();
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "";
}

TEST(MappedCsv, ReadsATableOfAnyMake) {
  const auto log = read_mapped("n [1/min],Load [g],phi\n6000,100,45\n", "own.csv",
                               roles({"thrust=Load", "speed=n [1/min]", "occlusion=phi:deg"}));
  ASSERT_EQ(log.rows.size(), 1u);
  EXPECT_NEAR(log.rows[0].thrust_n, 0.980665, 1e-12);
  EXPECT_EQ(log.rows[0].optical_rpm, 6000);
  EXPECT_EQ(log.rows[0].occlusion_deg, 45);
  EXPECT_EQ(log.thrust_unit, "g");
}

TEST(MappedCsv, TakesTheUnitFromBracketsSuffixOrMapping) {
  for (const char* header : {"f (mN),n_rpm\n", "f [mN],n_rpm\n", "f_mN,n_rpm\n"}) {
    const std::string name = std::string(header).substr(0, std::string(header).find(','));
    const auto log = read_mapped(std::string(header) + "500,60\n", "own.csv",
                                 {{Role::thrust, name, ""}, {Role::speed, "n_rpm", ""}});
    EXPECT_NEAR(log.rows.at(0).thrust_n, 0.5, 1e-15) << header;
  }
  const auto log = read_mapped("f,n\n2,10\n", "own.csv", roles({"thrust=f:lbf", "speed=n:Hz"}));
  EXPECT_NEAR(log.rows[0].thrust_n, 2 * 4.4482216152605, 1e-12);
  EXPECT_NEAR(*log.rows[0].optical_rpm, 600, 1e-12);
}

TEST(MappedCsv, NeverGuessesAUnit) {
  const auto read = [](const char* text, std::initializer_list<const char*> columns) {
    return refusal([&] { return read_mapped(text, "own.csv", roles(columns)); });
  };
  EXPECT_THAT(read("f,n_rpm\n1,2\n", {"thrust=f", "speed=n_rpm"}),
              HasSubstr("own.csv:1: column 'f' does not tell its unit; name it: --column thrust=f:UNIT"));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=f (N):gf", "speed=n_rpm"}), HasSubstr("which is right?"));
  EXPECT_THAT(read("f (stone),n_rpm\n1,2\n", {"thrust=f", "speed=n_rpm"}), HasSubstr("unit 'stone'"));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=g", "speed=n_rpm"}), HasSubstr("no column 'g'; there are 'f (N)'"));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=f"}), HasSubstr("a thrust and a speed are needed"));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=f", "thrust=f (N)", "speed=n_rpm"}), HasSubstr("thrust twice"));
  EXPECT_THAT(refusal([] { return parse_column_role("weight=f"); }), HasSubstr("ROLE of time, throttle, speed"));
}

TEST(MappedCsv, ReadsSemicolonsAndDecimalCommas) {
  const auto log =
      read_mapped("f (N);n (rpm)\n1,5;6000,5\n", "own.csv", roles({"thrust=f", "speed=n"}), {.decimal_comma = true});
  EXPECT_EQ(log.rows.at(0).thrust_n, 1.5);
  EXPECT_EQ(log.rows.at(0).optical_rpm, 6000.5);
  const auto tabs = read_mapped("f (N)\tn (rpm)\n1.5\t60\n", "own.csv", roles({"thrust=f", "speed=n"}));
  EXPECT_EQ(tabs.rows.at(0).thrust_n, 1.5);
}

TEST(MappedCsv, ListsTheLinesItCannotUse) {
  const auto log = read_mapped("f (N),n (rpm),phi (deg),rep\n,1,0,1\n1,2,400,1\n1,2,45,1.5\n1,2,45,2\n", "own.csv",
                               roles({"thrust=f", "speed=n", "occlusion=phi", "repetition=rep"}));
  ASSERT_EQ(log.problems.size(), 3u);
  EXPECT_THAT(log.problems[0].what, HasSubstr("thrust is no number"));
  EXPECT_THAT(log.problems[1].what, HasSubstr("outside 0 to 360"));
  EXPECT_THAT(log.problems[2].what, HasSubstr("no whole number"));
  ASSERT_EQ(log.rows.size(), 1u);
  EXPECT_EQ(log.rows[0].repetition, 2);
}

TEST(MappedCsv, KeepsOcclusionAndRepetitionInTheSteps) {
  ImportOptions options;
  options.columns = roles({"thrust=f", "speed=n", "occlusion=phi", "repetition=rep"});
  const Import import = import_table("f (N),n (rpm),phi (deg),rep\n1,6000,90,2\n2,9000,90,2\n", "own.csv", options);
  ASSERT_EQ(import.table.steps.size(), 2u);
  EXPECT_EQ(import.table.steps[0].occlusion_deg, 90);
  EXPECT_EQ(import.table.steps[0].repetition, 2);
  EXPECT_EQ(import.table.steps[0].propeller, "own");
}

}  // namespace
}  // namespace kphi::fit
