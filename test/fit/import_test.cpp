#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "compensation/units.hpp"
#include "fit/csv.hpp"
#include "fit/rcbenchmark_csv.hpp"
#include "fit/uiuc_table.hpp"
#include "profiles/configuration_error.hpp"
#include "results/file_layer.hpp"

namespace kphi::fit {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHeader =
    "Time (s),ESC signal (µs),Thrust (gf),Motor Electrical Speed (RPM),"
    "Motor Optical Speed (RPM),Voltage (V),App message,\n";

std::string table(const std::string& rows) { return std::string("\xEF\xBB\xBF") + kHeader + rows; }

std::string refusal(const std::string& text, const RcbenchmarkSelection& selection = {}) {
  try {
    (void)select_rows(read_rcbenchmark(text, "log.csv"), selection);
  } catch (const ConfigurationError& error) {
    return error.what();
  }
  return "";
}

TEST(Rcbenchmark, ConvertsTheUnitOfTheHeader) {
  const auto log = read_rcbenchmark(table("0,1100,100,6000,0,11.1,,\n"), "log.csv");
  EXPECT_EQ(log.thrust_unit, "gf");
  EXPECT_NEAR(log.rows[0].thrust_n, 0.980665, 1e-15);
  const auto kilo = read_rcbenchmark("Thrust (kgf),Motor Optical Speed (RPM)\n2,6000\n", "log.csv");
  EXPECT_NEAR(kilo.rows[0].thrust_n, 19.6133, 1e-12);
  const auto newton = read_rcbenchmark("Motor Optical Speed (RPM),Thrust (N)\n6000,2\n", "log.csv");
  EXPECT_EQ(newton.rows[0].thrust_n, 2) << "columns are found by name, in any order";
}

TEST(Rcbenchmark, RefusesAFileWithoutUnitOrSpeedAtItsHeader) {
  EXPECT_THAT(refusal("Thrust,Motor Optical Speed (RPM)\n1,2\n"), HasSubstr("log.csv:1: unit of column 'Thrust'"));
  EXPECT_THAT(refusal("Thrust (lbf),Motor Optical Speed (RPM)\n1,2\n"), HasSubstr("none of gf, kgf, N"));
  EXPECT_THAT(refusal("Thrust (N)\n1\n"), HasSubstr("log.csv:1: neither"));
  EXPECT_THAT(refusal("Thrust (N),Thrust (gf),Motor Optical Speed (RPM)\n1,1,1\n"), HasSubstr("two thrust columns"));
  EXPECT_THAT(refusal("Thrust (N),Thrust (N),Motor Optical Speed (RPM)\n1,1,1\n"), HasSubstr("more than one column"));
  EXPECT_THAT(refusal(""), HasSubstr("log.csv:1"));
}

TEST(Rcbenchmark, SelectsTheSpeedItIsTold) {
  const auto log = read_rcbenchmark(table("0,1100,100,6000,7000,11.1,,\n"), "log.csv");
  EXPECT_NEAR(to_rpm(RadPerSec(select_rows(log).steps[0].speed_rad_s)), 6000, 1e-9);
  EXPECT_NEAR(to_rpm(RadPerSec(select_rows(log, {.speed = SpeedSource::optical}).steps[0].speed_rad_s)), 7000, 1e-9);
  const auto mended = select_rows(log, {.speed = SpeedSource::electrical, .speed_factor = 7.0 / 6});
  EXPECT_NEAR(to_rpm(RadPerSec(mended.steps[0].speed_rad_s)), 7000, 1e-9);
}

TEST(Rcbenchmark, FallsBackToTheOpticalSpeedWhereTheElectricalNeverTurns) {
  const auto imported = select_rows(read_rcbenchmark(table("0,1100,100,0,7000,11.1,,\n"), "log.csv"));
  EXPECT_EQ(imported.speed_source, "optical");
}

TEST(Rcbenchmark, RefusesASpeedThatIsNotInTheFile) {
  EXPECT_THAT(refusal("Thrust (N),Motor Optical Speed (RPM)\n1,600\n", {.speed = SpeedSource::electrical}),
              HasSubstr("--speed optical"));
  EXPECT_THAT(refusal(table("0,1100,100,6000,0,11.1,,\n"), {.speed = SpeedSource::optical}), HasSubstr("no row"));
}

TEST(Rcbenchmark, RefusesReversedThrustUnlessTold) {
  const std::string reversed = table("0,1100,-100,6000,0,11.1,,\n1,1200,-200,9000,0,11.1,,\n");
  EXPECT_THAT(refusal(reversed), HasSubstr("--reverse-thrust"));
  const auto mended = select_rows(read_rcbenchmark(reversed, "log.csv"), {.reverse_thrust = true});
  EXPECT_GT(mended.steps[0].thrust_n, 0);
}

TEST(Rcbenchmark, TaresWithRowsOfAStillMotorOnly) {
  const std::string log =
      table("0,1000,-10,0,0,11,,\n1,1000,-12,0,0,11,,\n2,1100,-99,0,0,11,,\n3,1200,89,6000,0,11,,\n");
  const auto imported = select_rows(read_rcbenchmark(log, "log.csv"), {.tare_rows = 2});
  EXPECT_NEAR(imported.tare_n, -11 * 9.80665e-3, 1e-15);
  EXPECT_NEAR(imported.steps[0].thrust_n, 100 * 9.80665e-3, 1e-15);
  EXPECT_THAT(refusal(log, {.tare_rows = 3}), HasSubstr("2 rows with the motor off, 3 are asked"));
}

TEST(Rcbenchmark, ListsTheLinesItLeavesOut) {
  const auto log = read_rcbenchmark(
      table("0,1100,,6000,0,11,,\n1,1100,5,6000,0,11,Stop, now, please,,\n2,1100,5,600,0,11,,\n"), "l.csv");
  EXPECT_EQ(log.rows.size(), 1u);
  ASSERT_EQ(log.problems.size(), 2u);
}

TEST(UiucTable, TakesTheDiameterFromTheName) {
  EXPECT_EQ(diameter_from_name("apcff_4.2x4_static_0615rd.txt"), 4.2);
  EXPECT_EQ(diameter_from_name("apcsf_10x7_static_kt0827.txt"), 10);
  EXPECT_FALSE(diameter_from_name("static.txt"));
  EXPECT_FALSE(diameter_from_name("xx"));
  EXPECT_FALSE(diameter_from_name(""));
  EXPECT_FALSE(diameter_from_name("a_0x3.txt"));
}

TEST(UiucTable, TurnsTheCoefficientIntoThrust) {
  const auto imported = read_uiuc("RPM CT CP\r\n6000 0.1 0.05\r\n", "apc_10x7_s.txt");
  EXPECT_NEAR(imported.steps[0].thrust_n, 0.1 * 1.225 * 100 * 100 * std::pow(0.254, 4), 1e-12);
  EXPECT_NEAR(imported.steps[0].speed_rad_s, 628.3185307, 1e-6);
  EXPECT_THROW((void)read_uiuc("RPM CT\n6000 0.1\n", "table.txt"), ConfigurationError) << "no diameter";
  EXPECT_NO_THROW((void)read_uiuc("RPM CT\n6000 0.1\n", "table.txt", {.diameter_in = 10}));
  EXPECT_THROW((void)read_uiuc("RPM CP\n6000 0.1\n", "a_10x7.txt"), ConfigurationError);
}

// ---- the reference fits -------------------------------------------------------------------------------------------

class ReferenceFits : public ::testing::Test {
 protected:
  void SetUp() override {
    const char* data = std::getenv("KPHI_TEST_DATA");
    if (data == nullptr || !std::filesystem::exists(std::string(data) + "/real/reference_k.csv"))
      GTEST_SKIP() << "KPHI_TEST_DATA names no folder with real/reference_k.csv";
    folder = std::string(data) + "/real/";
  }
  std::string folder;
};

/// The words of the column `variant` as a selection.
RcbenchmarkSelection selection_of(const std::string& variant) {
  RcbenchmarkSelection selection;
  const auto has = [&](const char* words) { return variant.find(words) != std::string::npos; };
  if (variant == "electrical RPM > 0") {
    selection.speed = SpeedSource::electrical;
  } else if (has("raw") || has("first 100 rows")) {
    selection.speed = SpeedSource::optical;
    selection.speed_above_rpm = 1000;
    selection.esc_above_us = 1100;
    if (has("first 100 rows")) selection.tare_rows = 100;
  } else {
    selection.speed = variant.starts_with("optical") ? SpeedSource::optical : SpeedSource::electrical;
    selection.speed_above_rpm = 1000;
    if (has("x 7/6")) selection.speed_factor = 7.0 / 6;
    if (has("within 0.02 of 7/6")) selection.optical_per_electrical = 7.0 / 6;
  }
  return selection;
}

TEST_F(ReferenceFits, EqualTheirNumbersInAllRows) {
  const Table reference = read_csv(results::read_text(folder + "reference_k.csv"), "reference_k.csv");
  ASSERT_EQ(reference.rows.size(), 176u);
  ASSERT_TRUE(reference.problems.empty());
  for (const TableRow& row : reference.rows) {
    const auto number = [&](const char* name) { return *parse_number(row.fields[reference.column(name)]); };
    const std::string& file = row.fields[reference.column("file")];
    const std::string& variant = row.fields[reference.column("variant")];
    SCOPED_TRACE(file + ": " + variant);
    const std::string text = results::read_text(folder + file);
    const ImportedTable imported = file.starts_with("uiuc")
                                       ? read_uiuc(text, folder + file)
                                       : select_rows(read_rcbenchmark(text, folder + file), selection_of(variant));
    EXPECT_EQ(static_cast<double>(imported.rows_total), number("rows_total"));
    ASSERT_EQ(static_cast<double>(imported.steps.size()), number("rows_used"));
    const auto points = points_of(imported.steps);
    const ThrustFit origin = fit_thrust(points);
    const ThrustFit offset = fit_thrust(points, {.form = ThrustForm::with_offset});
    EXPECT_NEAR(origin.parameters.k / number("k_n_s2_per_rad2"), 1, 1e-9);
    EXPECT_NEAR(origin.standard_error.k / number("se_k"), 1, 1e-4) << "five digits are printed";
    EXPECT_NEAR(origin.rms_n, number("rms_n"), 6e-7);
    EXPECT_NEAR(offset.parameters.k / number("k_with_offset"), 1, 1e-9);
    EXPECT_NEAR(offset.parameters.offset, number("offset_n"), 6e-8);
    EXPECT_NEAR(offset.rms_n, number("rms_with_offset_n"), 6e-7);
  }
}

TEST_F(ReferenceFits, ReportTheLineWithUnquotedCommas) {
  const std::string path = folder + "rcb1780-timeseries/ConstVel_2021-06-17_084922.csv";
  const RcbenchmarkLog log = read_rcbenchmark(results::read_text(path), path);
  ASSERT_EQ(log.problems.size(), 1u);
  EXPECT_EQ(log.problems[0].line, 2u);
  EXPECT_EQ(log.rows.size(), 4022u);
}

}  // namespace
}  // namespace kphi::fit
