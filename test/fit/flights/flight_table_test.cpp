// Flight logs as tables, and the layouts that say what their columns are.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "base/error.hpp"
#include "fit/flights/flight_log.hpp"
#include "results/file_layer.hpp"
#include "test/refusal.hpp"
#include "test/source_dir.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace flight_table_test {

using testing::ElementsAre;
using testing::HasSubstr;

FlightLayout layout_of(const std::string& series, const std::string& more = "") {
  return parse_flight_layout("format: kphi-flight-layout/1\n" + more + "series:\n" + series, "f.yaml");
}

const std::string kTime = "  - {channel: time, series: 't', unit: ms}\n";

TEST(FlightTable, ReadsADecodedBlackboxByTheShippedLayout) {
  std::string csv =
      "loopIteration, time (us), gyroADC[0], gyroADC[1], gyroADC[2], accSmooth[0], accSmooth[1], accSmooth[2], "
      "motor[0], "
      "motor[1], motor[2], motor[3], eRPM[0], eRPM[1], eRPM[2], eRPM[3], vbatLatest (V)\n";
  for (int k = 0; k < 3; ++k)
    csv += fmt::format("{}, {}, 90, -90, 45, 0, 1024, {}, 48, 0, 1047, 2047, 1400, 700, 70, 7, 16.1\n", k,
                       1'000'000 + 500 * k, 2048 + 2048 * k);
  const std::string shipped = test::source_dir() + "/profiles/betaflight_layout.yaml";
  const FlightLog log =
      parse_flight(csv, "flight.01.csv", parse_flight_layout(results::read_text(shipped), "betaflight.yaml"));
  EXPECT_EQ(log.format, "table");
  EXPECT_THAT(log.specific_force[2].time_s,
              ElementsAre(0, testing::DoubleNear(5e-4, 1e-9), testing::DoubleNear(1e-3, 1e-9)));
  EXPECT_THAT(log.specific_force[2].values,
              ElementsAre(testing::DoubleNear(9.80665, 1e-5), testing::DoubleNear(2 * 9.80665, 1e-5),
                          testing::DoubleNear(3 * 9.80665, 1e-5)));
  EXPECT_NEAR(log.specific_force[1].values[0], 9.80665 / 2, 1e-5);
  EXPECT_NEAR(log.angular_rate[1].values[0], -M_PI / 2, 1e-12);
  ASSERT_EQ(log.command.size(), 4u);
  EXPECT_NEAR(log.command[0].values[0], 0, 1e-6);
  EXPECT_NEAR(log.command[1].values[0], 0, 1e-6) << "disarmed";
  EXPECT_NEAR(log.command[2].values[0], 999.0 / 1999, 1e-4);
  EXPECT_NEAR(log.command[3].values[0], 1, 1e-4);
  EXPECT_NEAR(log.rotor_speed[0].values[0], 1400 * 100 / 7.0 * M_PI / 30, 0.01);
  EXPECT_NEAR(log.voltage.values[0], 16.1, 1e-12);
}

TEST(FlightTable, TurnsAxesAndUnits) {
  const FlightLog log =
      parse_flight("t,az,ay,a1,u,v\n0,-1,0.5,90,1500,14\n10,-2,,45,1250,15\n", "f.csv",
                   layout_of(kTime + "  - {channel: specific_force, number: 3, series: az, unit: g}\n"
                                     "  - {channel: specific_force, number: 2, series: ay, unit: m/s^2, "
                                     "factor: 2, offset: 1}\n"
                                     "  - {channel: arm_angle, number: 2, series: a1, unit: deg, offset: -45}\n"
                                     "  - {channel: command, series: u, unit: us}\n",
                             "frame: FRD\n"));
  EXPECT_THAT(log.specific_force[2].values, ElementsAre(9.80665, 2 * 9.80665));
  EXPECT_THAT(log.specific_force[1].values, ElementsAre(-2)) << "an empty field is left out";
  EXPECT_THAT(log.specific_force[2].time_s, ElementsAre(0, 0.01));
  ASSERT_EQ(log.arm_angle.size(), 2u);
  EXPECT_THAT(log.arm_angle[1].values,
              ElementsAre(testing::DoubleNear(M_PI / 4, 1e-15), testing::DoubleNear(0, 1e-15)));
  EXPECT_THAT(log.command[0].values, ElementsAre(testing::DoubleNear(0.5, 1e-12), testing::DoubleNear(0.25, 1e-12)));
}

TEST(FlightTable, ReadsOtherMarksAndEncodings) {
  const std::string text = "Flug 12\nt;az\n0;9,5\n10;10,25\n";
  std::string utf16 = "\xFF\xFE";
  for (const char c : text) utf16 += {c, '\0'};
  const FlightLayout layout = layout_of(kTime + "  - {channel: specific_force, number: 3, series: az, unit: m/s^2}\n");
  for (const std::string& bytes : {text, utf16})
    EXPECT_THAT(parse_flight(bytes, "f.csv", layout).specific_force[2].values, ElementsAre(9.5, 10.25));
}

TEST(FlightTable, AsksForTheMarkThatCanBeReadInTwoWays) {
  const std::string text = "t;v\n0;1,125\n10;1,250\n", series = kTime + "  - {channel: voltage, series: v, unit: V}\n";
  EXPECT_THAT(refusal([&] { return parse_flight(text, "f.csv", layout_of(series)); }),
              HasSubstr("say with `decimal: point` or `decimal: comma`"));
  EXPECT_THAT(parse_flight(text, "f.csv", layout_of(series, "decimal: comma\n")).voltage.values,
              ElementsAre(1.125, 1.25));
}

TEST(FlightTable, CountsLinesThatItLeavesOut) {
  const FlightLog log = parse_flight("t,v\n0,1.5\n5,2\nlanded\nx,3\n20,2.5\n10,4\n30,inf\n", "f.csv",
                                     layout_of(kTime + "  - {channel: voltage, series: v, unit: V}\n"));
  EXPECT_THAT(log.voltage.values, ElementsAre(1.5, 2, 2.5));
  std::string words;
  for (const Finding& finding : log.findings) words += finding.line() + "\n";
  EXPECT_THAT(words, HasSubstr("2 lines are left out, the first one (5)"));
  EXPECT_THAT(words, HasSubstr("v: 1 of 4 values have a time before the one before them"));
}

TEST(FlightTable, RefusesByOneLine) {
  const FlightLayout layout = layout_of(kTime + "  - {channel: voltage, series: v, unit: V}\n");
  EXPECT_THAT(
      refusal([&] { return parse_flight("t,v\n1,2\n2,3\n", "f.csv"); }),
      HasSubstr("f.csv:1: a table needs a flight layout that says which column is the time, the force, …; there are "
                "\"t\", \"v\""));
  EXPECT_THAT(refusal([&] { return parse_flight("t,u\n1,2\n2,3\n", "f.csv", layout); }),
              HasSubstr("no column \"v\"; there are"));
  EXPECT_THAT(refusal([&] { return parse_flight("", "f.csv", layout); }), HasSubstr("no line with anything in it"));
  EXPECT_THAT(refusal([&] { return parse_flight("t,v\n1,2\n2,3\n" + std::string(3 << 20, '1'), "f.csv", layout); }),
              HasSubstr("a line of more than 1 MiB"));
  EXPECT_THAT(refusal([&] { return parse_flight(std::string("PK\x03\x04") + "x", "f.csv", layout); }),
              HasSubstr("zip"));
  EXPECT_THAT(refusal([&] { return read_flight("/nowhere/f.ulg"); }), HasSubstr("/nowhere/f.ulg cannot be opened"));
  const test::TemporaryFolder folder;
  EXPECT_THAT(refusal([&] { return read_flight(folder.path()); }), HasSubstr("is a folder"));
}

TEST(FlightTable, IsReadFromAFile) {
  const test::TemporaryFolder folder;
  std::ofstream(folder.path() / "f.csv") << "t,v\n0,1.5\n1,2.5\n";
  EXPECT_THAT(read_flight(folder.path() / "f.csv", layout_of(kTime + "  - {channel: voltage, series: v, unit: V}\n"))
                  .voltage.values,
              ElementsAre(1.5, 2.5));
}

TEST(FlightLayout, RefusesWhatItCannotMean) {
  const auto words = [](const std::string& series) { return refusal([&] { return layout_of(series); }); };
  EXPECT_THAT(words("  - {channel: specific_force, number: 4, series: a, unit: g}\n"), HasSubstr("there are 3"));
  EXPECT_THAT(words("  - {channel: specific_force, series: a, unit: 'N'}\n"), HasSubstr("known are m/s^2, g"));
  EXPECT_THAT(words("  - {channel: time, series: a, unit: clock}\n"), HasSubstr("known are s, ms, us"));
  EXPECT_THAT(words("  - {channel: climb, series: a, unit: m/s, factor: 0}\n"), HasSubstr("factor"));
  EXPECT_THAT(words("  - {channel: climb, series: a, unit: m/s}\n  - {channel: climb, series: b, unit: m/s}\n"),
              HasSubstr("a second climb 1"));
}

}  // namespace flight_table_test
}  // namespace kphi::fit
