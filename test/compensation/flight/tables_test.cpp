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

NineFlights one_hover() {
  NineFlights flights;
  FlightResult& flight = flights[kHoverPlain];
  flight.leg_count = 3;
  flight.legs[1].mean_error = {0.0726, -0.0762, 0.1535};
  flight.legs[1].mean_error_rate = {0, 0, 0.0036};
  flight.legs[2].mean_error = {0, 0, -0.01};
  return flights;
}

TEST(HoverTable, PutsOursBesideThePapers) {
  const std::string table = hover_table(one_hover());
  EXPECT_THAT(table, HasSubstr("X       O n.c.    0.0726  0.0762  0.1535  below     0.2200  0.1100  0.1700\n"));
  EXPECT_THAT(table, HasSubstr("O n.c.  X         0.0000  0.0000  0.0100  above "));
  EXPECT_THAT(table, Not(HasSubstr("X       O c."))) << "that flight was not flown";
}

TEST(HoverTable, SaysLostInsteadOfANumber) {
  NineFlights flights = one_hover();
  flights[kHoverPlain].lost = true;
  flights[kHoverPlain].lost_leg = 1;
  EXPECT_THAT(hover_table(flights), HasSubstr("X       O n.c.      lost "));
  EXPECT_THAT(hover_table(flights), Not(HasSubstr("0.1535")));
  EXPECT_THAT(height_table(flights, example_gains()), testing::IsEmpty());
}

TEST(HeightTable, ShowsTheIdentityForOursAndThePapers) {
  const std::string table = height_table(one_hover(), example_gains());
  EXPECT_THAT(table, HasSubstr("0.1535  0.0036"));
  EXPECT_THAT(table, HasSubstr("  2.324 ")) << "15 * 0.1535 + 6 * 0.0036";
  EXPECT_THAT(table, HasSubstr("-0.5005")) << "the paper's, from its own e and e'";
}

TEST(ForwardTable, ShowsMeanAndDeviationBesideThePapers) {
  NineFlights flights;
  flights[kRisingSwitched].leg_count = 2;
  flights[kRisingSwitched].legs[0].mean_distance = 0.1939;
  flights[kRisingSwitched].legs[0].deviation = 0.0177;
  const std::string table = forward_table(flights);
  EXPECT_THAT(table, HasSubstr("rising O n.c. - O c."));
  EXPECT_THAT(table, HasSubstr("0.194 ±0.018  ( 0.213 ±0.045)"));
  EXPECT_THAT(table, Not(HasSubstr("level")));
}

TEST(Tables, OfNothingFlownAreEmpty) {
  EXPECT_EQ(hover_table({}) + height_table({}, example_gains()) + forward_table({}), "");
}

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

TEST(NotReproduced, NamesTheXBaselineAndTheVelocityTerm) {
  EXPECT_THAT(not_reproduced(), HasSubstr("the errors in X of Tables I and III"));
  EXPECT_THAT(not_reproduced(), HasSubstr("the velocity term of Table II"));
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
  EXPECT_THAT(lines[0], HasSubstr("speed4_rad_s"));
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

TEST(ErrorFigure, NamesTheFlightAndItsLegs) {
  const std::string script = error_figure(kExperiments[kHoverPlain], example_trace());
  EXPECT_THAT(script, HasSubstr("title 'hover: X, O n.c., X   (reference - estimate"));
  EXPECT_THAT(script, HasSubstr("set label 'O n.c.' at 10"));
  EXPECT_THAT(script, HasSubstr("set ylabel 'z error [m]'"));
}

}  // namespace tables_test
}  // namespace kphi::flight
