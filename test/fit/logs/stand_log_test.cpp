#include "fit/logs/stand_log.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "compensation/units.hpp"
#include "fit/logs/import_table.hpp"

namespace kphi::fit {
namespace stand_log_test {

using ::testing::HasSubstr;

LayoutHints hints(const std::vector<const char*>& texts) {
  LayoutHints given;
  for (const char* text : texts) given.columns.push_back(parse_column_role(text));
  return given;
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

TEST(NamedColumns, ReadsATableOfAnyMake) {
  const auto log = read_log("n [1/min],Load [g],phi\n6000,100,45\n", "own.csv",
                            hints({"thrust=Load", "speed=n [1/min]", "occlusion=phi:deg"}));
  ASSERT_EQ(log.rows.size(), 1u);
  EXPECT_NEAR(log.rows[0].thrust_n, 0.980665, 1e-12);
  EXPECT_EQ(log.rows[0].optical_rpm, 6000);
  EXPECT_EQ(log.rows[0].occlusion_deg, 45);
  EXPECT_EQ(log.thrust_unit, "g");
}

TEST(NamedColumns, TakesTheUnitFromBracketsSuffixOrMapping) {
  for (const char* header : {"f (mN),n_rpm\n", "f [mN],n_rpm\n", "f_mN,n_rpm\n"}) {
    const std::string name = std::string(header).substr(0, std::string(header).find(','));
    const auto log = read_log(std::string(header) + "500,60\n", "own.csv",
                              LayoutHints{.columns = {{Role::thrust, name, ""}, {Role::speed, "n_rpm", ""}}});
    EXPECT_NEAR(log.rows.at(0).thrust_n, 0.5, 1e-15) << header;
  }
  const auto log = read_log("f,n\n2,10\n", "own.csv", hints({"thrust=f:lbf", "speed=n:Hz"}));
  EXPECT_NEAR(log.rows[0].thrust_n, 2 * 4.4482216152605, 1e-12);
  EXPECT_NEAR(*log.rows[0].optical_rpm, 600, 1e-12);
}

TEST(NamedColumns, NeverGuessesAUnit) {
  const auto read = [](const char* text, const std::vector<const char*>& columns) {
    return refusal([&] { return read_log(text, "own.csv", hints(columns)); });
  };
  EXPECT_THAT(read("f,n_rpm\n1,2\n", {"thrust=f", "speed=n_rpm"}),
              HasSubstr("own.csv:1: no unit given for column \"f\"; name it: --column thrust=f:UNIT"));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=f (N):gf", "speed=n_rpm"}), HasSubstr("unit mismatch"));
  EXPECT_THAT(read("f (stone),n_rpm\n1,2\n", {"thrust=f", "speed=n_rpm"}), HasSubstr("unit \"stone\""));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=g", "speed=n_rpm"}),
              HasSubstr("no column \"g\"; the file has \"f (N)\""));
  EXPECT_THAT(read("f (N),m\n1,2\n", {"thrust=f"}),
              HasSubstr("no column is surely the speed; name it: --column speed="));
  EXPECT_THAT(read("f (N),n_rpm\n1,2\n", {"thrust=f", "thrust=f (N)", "speed=n_rpm"}), HasSubstr("thrust twice"));
  EXPECT_THAT(refusal([] { return parse_column_role("weight=f"); }), HasSubstr("ROLE one of time, throttle, speed"));
}

TEST(NamedColumns, ReadsSemicolonsAndDecimalCommas) {
  const auto log = read_log("f (N);n (rpm)\n1,5;6000,5\n", "own.csv", hints({"thrust=f", "speed=n"}));
  EXPECT_EQ(log.rows.at(0).thrust_n, 1.5);
  EXPECT_EQ(log.rows.at(0).optical_rpm, 6000.5);
  const auto tabs = read_log("f (N)\tn (rpm)\n1.5\t60\n", "own.csv", hints({"thrust=f", "speed=n"}));
  EXPECT_EQ(tabs.rows.at(0).thrust_n, 1.5);
}

TEST(NamedColumns, ListsTheLinesItCannotUse) {
  const auto log = read_log("f (N),n (rpm),phi (deg),rep\n,1,0,1\n1,2,400,1\n1,2,45,1.5\n1,2,45,2\n", "own.csv",
                            hints({"thrust=f", "speed=n", "occlusion=phi", "repetition=rep"}));
  ASSERT_EQ(log.problems.size(), 3u);
  EXPECT_THAT(log.problems[0].what, HasSubstr("thrust is missing; line skipped"));
  EXPECT_THAT(log.problems[1].what, HasSubstr("outside 0 to 360°"));
  EXPECT_THAT(log.problems[2].what, HasSubstr("not a whole number"));
  ASSERT_EQ(log.rows.size(), 1u);
  EXPECT_EQ(log.rows[0].repetition, 2);
}

TEST(NamedColumns, KeepsOcclusionAndRepetitionInTheSteps) {
  ImportOptions options;
  options.hints = hints({"thrust=f", "speed=n", "occlusion=phi", "repetition=rep"});
  const Import import = import_table("f (N),n (rpm),phi (deg),rep\n1,6000,90,2\n2,9000,90,2\n", "own.csv", options);
  ASSERT_EQ(import.table.size(), 2u);
  EXPECT_EQ(import.table.step(0).occlusion_deg, 90);
  EXPECT_EQ(import.table.step(0).repetition, 2);
  EXPECT_EQ(import.table.step(0).propeller, "own");
}

TEST(ColumnUnit, StandsInBracketsOfEitherKindOrBehindAnUnderscore) {
  EXPECT_EQ(split_header("Motor Optical Speed (RPM)").name, "Motor Optical Speed");
  EXPECT_EQ(split_header("Motor Optical Speed (RPM)").unit, "RPM");
  EXPECT_EQ(split_header("Kraft [kgf]").unit, "kgf");
  EXPECT_EQ(split_header("thrust (raw) [N]").name, "thrust (raw)");
  EXPECT_EQ(split_header("plain").unit, "");
  EXPECT_EQ(split_header("").name, "");
  EXPECT_EQ(unit_in("speed_rad_s", Measure::speed), "rad_s");
  EXPECT_EQ(unit_in("thrust_n", Measure::thrust), "n");
  EXPECT_EQ(unit_in("thrust_mean", Measure::thrust), "");
}

TEST(ColumnUnit, ConvertsExactlyAndOnlyUnitsOfItsMeasure) {
  EXPECT_DOUBLE_EQ(unit_named(Measure::thrust, "gf")->factor, 9.80665e-3);
  EXPECT_DOUBLE_EQ(unit_named(Measure::thrust, "lbf")->factor, 4.4482216152605);
  EXPECT_DOUBLE_EQ(unit_named(Measure::thrust, "ozf")->factor * 16, unit_named(Measure::thrust, "lbf")->factor);
  EXPECT_NEAR(unit_named(Measure::speed, "rad/s")->factor, 9.549296585513721, 1e-14);
  EXPECT_DOUBLE_EQ(unit_named(Measure::torque, "lbf·ft")->factor, 4.4482216152605 * 0.3048);
  for (const char* other : {"RPM", "", "MN"}) EXPECT_FALSE(unit_named(Measure::thrust, other)) << other;
}

constexpr const char* kHeader =
    "Time (s),ESC signal (µs),Thrust (gf),Motor Electrical Speed (RPM),"
    "Motor Optical Speed (RPM),Voltage (V),App message,\n";

std::string table(const std::string& rows) { return std::string("\xEF\xBB\xBF") + kHeader + rows; }

std::string table_refusal(const std::string& text, const RowSelection& selection = {}) {
  return refusal([&] { return select_rows(read_log(text, "log.csv"), selection); });
}

double rpm_of(const StandLog& log, const RowSelection& selection) {
  return to_rpm(RadPerSec(select_rows(log, selection).step(0).speed_rad_s));
}

TEST(Rcbenchmark, ConvertsTheUnitOfTheHeader) {
  const auto log = read_log(table("0,1100,100,6000,0,11.1,,\n"), "log.csv");
  EXPECT_EQ(log.thrust_unit, "gf");
  EXPECT_NEAR(log.rows[0].thrust_n, 0.980665, 1e-15);
  const auto kilo = read_log("Thrust (kgf),Motor Optical Speed (RPM)\n2,6000\n", "log.csv");
  EXPECT_NEAR(kilo.rows[0].thrust_n, 19.6133, 1e-12);
  const auto newton = read_log("Motor Optical Speed (RPM),Thrust (N)\n6000,2\n", "log.csv");
  EXPECT_EQ(newton.rows[0].thrust_n, 2) << "columns are found by name, in any order";
}

TEST(Rcbenchmark, RefusesAFileWithoutUnitOrSpeedAtItsHeader) {
  for (const auto& [text, words] : {
           std::pair{"Thrust,Motor Optical Speed (RPM)\n1,2\n", "log.csv:1: no unit given for column \"Thrust\""},
           {"Thrust (stone),Motor Optical Speed (RPM)\n1,2\n", "known are N, mN, kN, gf, kgf, lbf, ozf"},
           {"Thrust (N)\n1\n", "log.csv:1: no table: none of the first 2 lines has two numbers"},
           {"Thrust (N),Torque (Nm)\n1,1\n", "log.csv:1: no column is surely the speed"},
           {"Thrust (N),Thrust (gf),Motor Optical Speed (RPM)\n1,1,1\n",
            "2 columns may be the thrust: \"Thrust (N)\", \"Thrust (gf)\"; name the one"},
           {"Thrust (N),Thrust (N),Motor Optical Speed (RPM)\n1,1,1\n", "2 columns may be the thrust"},
           {"", "log.csv:1"},
       })
    EXPECT_THAT(table_refusal(text), HasSubstr(words)) << text;
}

TEST(Rcbenchmark, SelectsTheSpeedItIsTold) {
  const auto log = read_log(table("0,1100,100,6000,7000,11.1,,\n"), "log.csv");
  EXPECT_NEAR(rpm_of(log, {}), 6000, 1e-9);
  EXPECT_NEAR(rpm_of(log, {.speed = SpeedSource::optical}), 7000, 1e-9);
  EXPECT_NEAR(rpm_of(log, {.speed = SpeedSource::electrical, .speed_factor = 7.0 / 6}), 7000, 1e-9);
  const auto never = select_rows(read_log(table("0,1100,100,0,7000,11.1,,\n"), "log.csv"));
  EXPECT_EQ(never.speed_source, "optical") << "where the electrical speed never turns";
}

TEST(Rcbenchmark, RefusesASpeedThatIsNotInTheFile) {
  EXPECT_THAT(table_refusal("Thrust (N),Motor Optical Speed (RPM)\n1,600\n", {.speed = SpeedSource::electrical}),
              HasSubstr("--speed optical"));
  EXPECT_THAT(table_refusal(table("0,1100,100,6000,0,11.1,,\n"), {.speed = SpeedSource::optical}), HasSubstr("no row"));
}

TEST(Rcbenchmark, RefusesReversedThrustUnlessTold) {
  const std::string reversed = table("0,1100,-100,6000,0,11.1,,\n1,1200,-200,9000,0,11.1,,\n");
  EXPECT_THAT(table_refusal(reversed), HasSubstr("--reverse-thrust"));
  const auto mended = select_rows(read_log(reversed, "log.csv"), {.reverse_thrust = true});
  EXPECT_GT(mended.step(0).thrust_n, 0);
}

TEST(Rcbenchmark, TaresWithRowsOfAStillMotorOnly) {
  const std::string log =
      table("0,1000,-10,0,0,11,,\n1,1000,-12,0,0,11,,\n2,1100,-99,0,0,11,,\n3,1200,89,6000,0,11,,\n");
  const auto imported = select_rows(read_log(log, "log.csv"), {.tare_rows = 2});
  EXPECT_NEAR(imported.tare_n, -11 * 9.80665e-3, 1e-15);
  EXPECT_NEAR(imported.step(0).thrust_n, 100 * 9.80665e-3, 1e-15);
  EXPECT_THAT(table_refusal(log, {.tare_rows = 3}), HasSubstr("2 rows with the motor off, but --tare-rows asks for 3"));
}

TEST(Rcbenchmark, ListsTheLinesItLeavesOut) {
  const auto log =
      read_log(table("0,1100,,6000,0,11,,\n1,1100,5,6000,0,11,Stop, now, please,,\n2,1100,5,600,0,11,,\n"), "l.csv");
  EXPECT_EQ(log.rows.size(), 1u);
  ASSERT_EQ(log.problems.size(), 2u);
}

TEST(Rcbenchmark, LeavesOutAColumnOfAnUnknownUnitAndSaysSo) {
  const auto log = read_log("Thrust (N),Motor Optical Speed (Hz),Voltage (furlong)\n2,100,7\n", "l.csv");
  EXPECT_NEAR(*log.rows[0].optical_rpm, 6000, 1e-9);
  EXPECT_FALSE(log.rows[0].voltage_v);
  ASSERT_EQ(log.unread.size(), 1u);
  EXPECT_THAT(log.unread[0], HasSubstr("unknown unit \"furlong\" of column \"Voltage (furlong)\"; known are V, mV"));
}

TEST(Rcbenchmark, RefusesATareThatScatters) {
  std::string rows;
  for (int i = 0; i < 10; ++i) rows += fmt::format("{},1000,{},0,0,11,,\n", i, i % 2 == 0 ? 50 : -50);
  EXPECT_THAT(table_refusal(table(rows + "10,1500,1000,9000,0,11,,\n"), {.tare_rows = 10}),
              HasSubstr("cannot give a zero"));
}

TEST(Rcbenchmark, SaysThatASpeedIsBlindBeforeItSaysReversed) {
  std::string text = "Time (s),ESC signal (µs),Thrust (N),Motor Electrical Speed (RPM),Motor Optical Speed (RPM)\n";
  for (int i = 0; i < 20; ++i) text += fmt::format("{},1500,3.0,0,{}\n", i, 6000 + i);
  for (int i = 0; i < 3; ++i) text += fmt::format("{},1000,-0.02,120,0\n", 20 + i);  // all that the sensor saw
  const StandLog log = read_log(text, "Polar.csv");
  EXPECT_THAT(refusal([&] { return select_rows(log); }),
              HasSubstr("the electrical speed reads 0 in 20 of 20 rows with thrust: its sensor does not see the "
                        "propeller; take the other with --speed optical"));
  EXPECT_EQ(select_rows(log, {.speed = SpeedSource::optical}).size(), 20u);
}

TEST(Rcbenchmark, CountsValuesThatAreNoNumbersAndKeepsTheRow) {
  const StandLog log =
      read_log("Thrust (N),Motor Optical Speed (RPM),Voltage (V)\n1.5,6000,12\n2.5,7000,n/a\n3.5,8000,\nnan,9000,12\n",
               "log.csv");
  EXPECT_EQ(log.rows.size(), 3u);
  ASSERT_EQ(log.not_numbers.size(), 1u) << "an empty field says nothing";
  EXPECT_EQ(log.not_numbers[0].line, 3u);
  EXPECT_THAT(log.not_numbers[0].what, HasSubstr("voltage \"n/a\" is not a number"));
  ASSERT_EQ(log.problems.size(), 1u);
  EXPECT_THAT(log.problems[0].what, HasSubstr("thrust \"nan\" is not a number"));
}

TEST(Import, WritesItsCoefficientDown) {
  ImportOptions options;
  options.hints = hints({"thrust=f:N", "speed=n:RPM"});
  constexpr const char* kText = "f,n\n1,5000\n4,10000\n9,15000\n";
  const Import import = import_table(kText, "log.csv", options);
  const auto record =
      nlohmann::json::parse(import_record(import, judged_fit(import.table), "0123", "log.csv", options, "1"));
  EXPECT_NEAR(record["k_n_s2_per_rad2"].get<double>(), 4 / std::pow(from_rpm(10000).value(), 2), 1e-15);
}

}  // namespace stand_log_test
}  // namespace kphi::fit
