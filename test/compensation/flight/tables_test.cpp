#include "compensation/flight/tables.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace tables_test {

using testing::HasSubstr;
using testing::Not;

TEST(FindingsTable, TellsOverWhichDrawsItsPercentilesGoAndOnlyOfLawsThatWereDrawn) {
  Findings found;
  found.draws = 3;
  found.kept = 2;
  found.lost_plain = 1;
  found.by_law[0] = {2, 0.251, 0.462};
  const std::string table = findings_table(found);
  EXPECT_THAT(table, HasSubstr("3 draws; with a flight lost: 1 without compensation, 0 with or in X. Percentiles are "
                               "over the 2 others."));
  EXPECT_THAT(table, HasSubstr("law quadratic         hover z 0.25, forward 0.46\n"));
  EXPECT_THAT(table, Not(HasSubstr("steep_onset")));
}

TEST(FindingsTable, HasNoNumbersWhereEveryDrawLostAFlight) {
  Findings found;
  found.draws = found.lost_plain = 3;
  EXPECT_THAT(findings_table(found), HasSubstr("no percentiles"));
  EXPECT_THAT(findings_table(found), Not(HasSubstr("0.000")));
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

long commas(const std::string& line) { return std::count(line.begin(), line.end(), ','); }

const std::vector<TraceRow>& example_trace() {
  static const std::vector<TraceRow> kTrace = [] {
    std::vector<TraceRow> trace;
    (void)fly(kExperiments[kHoverPlain], example_scene(), example_shadow(), &trace);
    return trace;
  }();
  return kTrace;
}

TEST(TraceCsv, HasAFieldForEveryColumnAndARowForEveryTick) {
  const std::vector<std::string> lines = lines_of(trace_csv(example_trace()));
  ASSERT_EQ(lines.size(), example_trace().size() + 1);
  for (const std::string& line : lines) ASSERT_EQ(commas(line), commas(lines[0])) << line;
  EXPECT_THAT(lines[0], HasSubstr("time_s,leg,reference_x_m"));
  EXPECT_THAT(lines[0], HasSubstr("phi1_believed_rad,phi2_believed_rad"));
  EXPECT_THAT(lines[1], testing::StartsWith("0,1,0,0,1.5,"));
}

TEST(DrawsCsv, HasAFieldForEveryColumnAndARowForEveryDraw) {
  const auto draws = fly_draws(example_scene(), example_shadow(), 2, 2);
  const std::vector<std::string> lines = lines_of(draws_csv(draws));
  ASSERT_EQ(lines.size(), 3u);
  for (const std::string& line : lines) EXPECT_EQ(commas(line), commas(lines[0])) << line;
  EXPECT_THAT(lines[1], testing::StartsWith("0,quadratic,1."));
  EXPECT_THAT(lines[2], testing::StartsWith("1,quadratic_by_load,1."));
}

TEST(ComparisonFigure, ShowsBothFlightsWithArmsOcclusionsAndSpeeds) {
  const std::string script =
      comparison_figure("Hover: X, O, X", kExperiments[kHoverPlain], example_trace(), example_trace());
  EXPECT_THAT(script, HasSubstr("title 'Hover: X, O, X'"));
  for (const char* axis : {"below reference [m]", "arm angle [deg]", "occlusion [deg]", "speed [RPM]"}) {
    EXPECT_THAT(script, HasSubstr(std::string("set ylabel '") + axis + "'"));
  }
}

TEST(ErrorFigure, NamesTheFlightAndItsLegs) {
  const std::string script = error_figure(kExperiments[kHoverPlain], example_trace());
  EXPECT_THAT(script, HasSubstr("title 'hover: X, O n.c., X   (reference - estimate"));
  EXPECT_THAT(script, HasSubstr("set label 'O n.c.' at 10"));
  EXPECT_THAT(script, HasSubstr("set ylabel 'z error [m]'"));
}

}  // namespace tables_test
}  // namespace kphi::flight
