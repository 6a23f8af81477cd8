#include "base/csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "base/error.hpp"

namespace kphi::fit {
namespace csv_test {

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
  const Table table = read_csv("a,b\n\"1,5\",\"say \"\"hi\"\"\"\n\"open,2\n\"x\"y2\n", "t.csv");
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_THAT(table.rows[0].fields, ElementsAre("1,5", "say \"hi\""));
  EXPECT_EQ(table.problems.size(), 2u);
}

TEST(Csv, ReadsBlocksAsItReadsTheWhole) {
  const std::string text = "\xEF\xBB\xBF\na,b\n1,2\n\n\"open,2\n3,4,5\r\n6,7";
  const Table whole = read_csv(text, "t.csv");
  ASSERT_EQ(whole.rows.size(), 2u);
  for (std::size_t cuts = 0; cuts < 64; ++cuts) {  // after each line or not
    std::vector<std::string_view> blocks;
    std::size_t begin = 0, at = 0;
    for (int line = 0; (at = text.find('\n', at)) != std::string::npos; ++line) {
      ++at;
      if ((cuts >> line & 1) == 0) continue;
      blocks.push_back(std::string_view(text).substr(begin, at - begin));
      begin = at;
    }
    blocks.push_back(std::string_view(text).substr(begin));
    std::size_t next = 0;
    const Table table = read_csv(
        TextBlocks([&] { return next < blocks.size() ? blocks[next++] : std::string_view(); }, text.size()), "t.csv");
    EXPECT_EQ(table.header, whole.header) << cuts;
    ASSERT_EQ(table.rows.size(), whole.rows.size()) << cuts;
    EXPECT_EQ(table.rows[1].line, whole.rows[1].line);
    EXPECT_EQ(table.rows[1].fields, whole.rows[1].fields);
    ASSERT_EQ(table.problems.size(), whole.problems.size());
    EXPECT_EQ(table.problems[1].line, whole.problems[1].line);
  }
}

TEST(Csv, FindsColumnsByNameInAnyOrder) {
  const Table table = read_csv("\nb,a,b\n", "t.csv");
  EXPECT_EQ(table.header_line, 2u);
  EXPECT_THAT(read_csv("a,b;c\n", "t.csv", 0).header, ElementsAre("a", "b;c")) << "a comma, where nothing tells more";
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

}  // namespace csv_test
}  // namespace kphi::fit
