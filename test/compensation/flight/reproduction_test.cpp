#include "compensation/flight/reproduction.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace reproduction_test {

using testing::HasSubstr;

const PaperCell& cell_of(const std::vector<PaperCell>& cells, const std::string& row, const std::string& what) {
  const auto found = std::find_if(cells.begin(), cells.end(), [&](const PaperCell& cell) {
    return cell.row.find(row) != std::string::npos && cell.what == what;
  });
  EXPECT_NE(found, cells.end()) << row << " " << what;
  return *found;
}

TEST(Reproduction, HasEveryNumberOfThePapersTables) {
  const NineFlights flights = fly_all(clean_scene(), example_shadow());
  const auto cells = paper_cells(flights, flights, {}, example_gains());
  EXPECT_EQ(cells.size(), 7u * 3 + 2 * 3 + 12 * 2);
  EXPECT_EQ(cell_of(cells, "X -> O n.c.", "|z| [m]").paper, 0.17);
  EXPECT_EQ(cell_of(cells, "O n.c. -> O c.", "|z| [m]").paper, 0.0106);
  EXPECT_EQ(cell_of(cells, "rising O n.c. - O c., O c.", "std. dev. [m]").paper, 0.0611);
  const PaperCell& height = cell_of(cells, "Table II  X -> O n.c.", "e'' [m/s2]");
  EXPECT_NEAR(height.world.value(), 15 * cell_of(cells, "Table II  X -> O n.c.", "e [m]").world.value(), 0.1);
  EXPECT_EQ(height.reproduced, Reproduced::unknown) << "no draws, no spread";
}

TEST(Reproduction, JudgesEachNumberByTheSpreadOfTheDraws) {
  const auto draws = fly_draws(example_scene(), example_shadow(), 24, 2);
  const NineFlights flights = fly_all(clean_scene(), example_shadow());
  const auto cells = paper_cells(flights, flights, draws, example_gains());
  EXPECT_EQ(cell_of(cells, "X -> O n.c.", "|z| [m]").reproduced, Reproduced::within);
  EXPECT_EQ(cell_of(cells, "Table II  X -> O n.c.", "e' [m/s]").reproduced, Reproduced::not_reproduced);
  EXPECT_EQ(cell_of(cells, "level  X - O n.c., X", "std. dev. [m]").reproduced, Reproduced::not_reproduced);
  for (const PaperCell& cell : cells) {
    EXPECT_LE(cell.spread.p10, cell.spread.p90);
    EXPECT_NE(cell.reproduced, Reproduced::unknown) << cell.row;
  }
  const std::string table = reproduction_table(cells, 1.4);
  EXPECT_THAT(table, HasSubstr("gamma 1.4"));
  EXPECT_THAT(table, HasSubstr("not reproduced"));

  // Table and list agree: a reason for each number that is not reproduced, and no other.
  const std::string list = not_reproduced(cells);
  std::set<Reason> used;
  for (const PaperCell& cell : cells)
    if (cell.reproduced == Reproduced::not_reproduced) used.insert(cell.reason);
  const auto listed = reasons_of(cells);
  EXPECT_EQ(std::set<Reason>(listed.begin(), listed.end()), used);
  EXPECT_GE(used.size(), 2u);
  for (const Reason reason : used) {
    const std::string letter = std::string("(") + letter_of(reason) + ")";
    EXPECT_THAT(table, HasSubstr("not reproduced " + letter));
    EXPECT_THAT(list, HasSubstr(letter + " " + std::string(kReasons[static_cast<std::size_t>(reason)])));
  }
  EXPECT_EQ(std::count(list.begin(), list.end(), '\n'), static_cast<long>(used.size()) + 1);
}

TEST(Reproduction, WithoutDrawsNamesTheReasonsThatThereMayBe) {
  const NineFlights flights = fly_all(clean_scene(), example_shadow());
  const auto cells = paper_cells(flights, flights, {}, example_gains());
  EXPECT_EQ(reasons_of(cells).size(), kReasons.size());
  EXPECT_THAT(not_reproduced(cells), HasSubstr("--draws 300 tells which"));
  EXPECT_EQ(not_reproduced({}), "");
}

TEST(Reproduction, SaysLostInsteadOfANumber) {
  NineFlights flights;
  flights[kHoverPlain].leg_count = 3;
  flights[kHoverPlain].lost = true;
  flights[kHoverPlain].lost_leg = 1;
  const auto cells = paper_cells(flights, flights, {}, example_gains());
  EXPECT_FALSE(cell_of(cells, "X -> O n.c.", "|x| [m]").world);
  EXPECT_THAT(reproduction_table(cells, 1.4), HasSubstr("lost"));
  EXPECT_EQ(cells.size(), 3u * 3 + 3) << "what was not flown is left out";
}

TEST(CogTable, ShowsThatThePapersXAndYAreNoTestOfTheCompensation) {
  const auto signs = signs_of_cog(clean_scene(), example_shadow());
  ASSERT_EQ(signs.size(), 5u);
  double least = 1e9, most = 0;
  for (const CogSign& sign : signs) {
    least = std::min(least, sign.hover_xy_plain);
    most = std::max(most, sign.hover_xy_plain);
  }
  EXPECT_GT(most, 1.2 * least);
  EXPECT_THAT(cog_table(signs), HasSubstr("+1.0  -0.5"));
}

}  // namespace reproduction_test
}  // namespace kphi::flight
