#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "compensation/units.hpp"
#include "fit/logs/import_table.hpp"
#include "fit/logs/rcbenchmark_csv.hpp"
#include "fit/logs/uiuc_table.hpp"
#include "results/file_layer.hpp"

namespace kphi::fit {
namespace {

using ::testing::HasSubstr;

constexpr const char* kHeader =
    "Time (s),ESC signal (µs),Thrust (gf),Motor Electrical Speed (RPM),"
    "Motor Optical Speed (RPM),Voltage (V),App message,\n";

std::string table(const std::string& rows) { return std::string("\xEF\xBB\xBF") + kHeader + rows; }

std::string refusal(const std::string& text, const RowSelection& selection = {}) {
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
  EXPECT_THAT(refusal("Thrust (stone),Motor Optical Speed (RPM)\n1,2\n"),
              HasSubstr("none of N, mN, kN, gf, kgf, lbf, ozf"));
  EXPECT_THAT(refusal("Thrust (N)\n1\n"), HasSubstr("log.csv:1: neither"));
  EXPECT_THAT(refusal("Thrust (N),Thrust (gf),Motor Optical Speed (RPM)\n1,1,1\n"), HasSubstr("two Thrust columns"));
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

TEST(Rcbenchmark, LeavesOutAColumnOfAnUnknownUnitAndSaysSo) {
  const auto log = read_rcbenchmark("Thrust (N),Motor Optical Speed (Hz),Voltage (furlong)\n2,100,7\n", "l.csv");
  EXPECT_NEAR(*log.rows[0].optical_rpm, 6000, 1e-9);
  EXPECT_FALSE(log.rows[0].voltage_v);
  ASSERT_EQ(log.unread.size(), 1u);
  EXPECT_THAT(log.unread[0], HasSubstr("'Voltage (furlong)' is none of V, mV"));
}

TEST(Rcbenchmark, RefusesATareThatScatters) {
  std::string rows;
  for (int i = 0; i < 10; ++i) rows += fmt::format("{},1000,{},0,0,11,,\n", i, i % 2 == 0 ? 50 : -50);
  EXPECT_THAT(refusal(table(rows + "10,1500,1000,9000,0,11,,\n"), {.tare_rows = 10}), HasSubstr("no zero"));
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

// ---- real files -------------------------------------------------------------------------------------------

class RealData : public ::testing::Test {
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
RowSelection selection_of(const std::string& variant) {
  RowSelection selection;
  const auto has = [&](const char* words) { return variant.find(words) != std::string::npos; };
  if (variant == "electrical RPM > 0") {
    selection.speed = SpeedSource::electrical;
  } else if (has("raw") || has("first 100 rows")) {
    selection.speed = SpeedSource::optical;
    selection.speed_above_rpm = 1000;
    selection.throttle_above_us = 1100;
    if (has("first 100 rows")) selection.tare_rows = 100;
  } else {
    selection.speed = variant.starts_with("optical") ? SpeedSource::optical : SpeedSource::electrical;
    selection.speed_above_rpm = 1000;
    if (has("x 7/6")) selection.speed_factor = 7.0 / 6;
    if (has("within 0.02 of 7/6")) selection.optical_per_electrical = 7.0 / 6;
  }
  return selection;
}

TEST_F(RealData, GiveTheReferenceFitsInAllRows) {
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

std::map<std::string, std::vector<Finding>> findings_of(const std::string& folder) {
  std::map<std::string, std::vector<Finding>> all;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".csv") continue;
    const std::string path = entry.path().string();
    all[entry.path().stem().string()] = audit(read_rcbenchmark(results::read_text(path), path), {});
  }
  return all;
}

const Finding* find(const std::vector<Finding>& findings, FindingKind kind) {
  for (const Finding& finding : findings)
    if (finding.kind == kind) return &finding;
  return nullptr;
}

struct Tally {
  std::size_t files = 0, rows = 0;
};

std::map<FindingKind, Tally> tally_of(const std::map<std::string, std::vector<Finding>>& all) {
  std::map<FindingKind, Tally> tally;
  for (const auto& [name, findings] : all) {
    for (const Finding& finding : findings) {
      ++tally[finding.kind].files;
      tally[finding.kind].rows += finding.rows;
    }
  }
  return tally;
}

TEST_F(RealData, OfTheSeries1520HasItsKnownDirtAndNoOther) {
  const auto all = findings_of(folder + "rcb1520-5inch");
  ASSERT_EQ(all.size(), 160u);
  auto tally = tally_of(all);
  EXPECT_EQ(tally[FindingKind::speed_missing].rows, 43u) << "speed 0 with more than 5 gf";
  EXPECT_EQ(tally[FindingKind::speed_missing].files, 43u);
  EXPECT_EQ(tally[FindingKind::current_limit].files, 36u);
  EXPECT_EQ(tally[FindingKind::negative_thrust].rows, 30u);
  for (const char* file : {"e5_7", "f1_7", "f4_11", "f6_11", "h1_11"})
    EXPECT_NE(find(all.at(file), FindingKind::barely_turning), nullptr) << file << " has a row of 1 or 2 RPM";
  EXPECT_EQ(find(all.at("a3_11"), FindingKind::current_limit)->rows, 2u);
  const std::set<FindingKind> known{FindingKind::speed_missing, FindingKind::current_limit,
                                    FindingKind::negative_thrust, FindingKind::barely_turning,
                                    FindingKind::not_turning};
  std::size_t clean = 0;
  for (const auto& [name, findings] : all) {
    clean += findings.empty() ? 1 : 0;
    for (const Finding& finding : findings) EXPECT_TRUE(known.contains(finding.kind)) << name << ": " << finding.text;
    if (name.ends_with("_11")) {
      EXPECT_EQ(find(findings, FindingKind::speed_missing), nullptr) << name;
    } else {
      EXPECT_EQ(find(findings, FindingKind::current_limit), nullptr) << name;
    }
  }
  EXPECT_GE(clean, 40u);
}

TEST_F(RealData, OfOnePropellerShowsTheFilesUnlikeTheOthers) {
  std::set<std::string> outliers;
  for (char propeller = '1'; propeller <= '8'; ++propeller) {
    std::vector<NamedCoefficient> group;
    for (const auto& entry : std::filesystem::directory_iterator(folder + "rcb1520-5inch")) {
      const std::string path = entry.path().string(), name = entry.path().stem().string();
      if (entry.path().extension() != ".csv" || name[1] != propeller) continue;
      const auto imported = select_rows(read_rcbenchmark(results::read_text(path), path));
      group.push_back({name, fit_thrust(points_of(imported.steps)).parameters.k});
    }
    ASSERT_EQ(group.size(), 20u);
    for (const GroupOutlier& outlier : group_outliers(group)) outliers.insert(outlier.name);
  }
  EXPECT_EQ(outliers, (std::set<std::string>{"b4_7", "b4_11", "b7_11"}));
}

TEST_F(RealData, OfTheDynoHasTheWrongPoleCountAndTwoBadSpeeds) {
  const auto all = findings_of(folder + "rcb1585-dyno-lab");
  ASSERT_EQ(all.size(), 3u);
  std::map<std::size_t, int> disagreeing;
  for (const auto& [name, findings] : all) {
    SCOPED_TRACE(name);
    ASSERT_NE(find(findings, FindingKind::speed_ratio), nullptr);
    EXPECT_THAT(find(findings, FindingKind::speed_ratio)->text,
                AllOf(HasSubstr("7/6"), HasSubstr("14 poles were set for a motor of 12")));
    if (const Finding* rows = find(findings, FindingKind::speed_disagrees)) ++disagreeing[rows->rows];
    EXPECT_EQ(find(findings, FindingKind::time_backward) != nullptr, name.find("10in") != std::string::npos);
    EXPECT_THROW((void)import_table(results::read_text(folder + "rcb1585-dyno-lab/" + name + ".csv"), name, {}),
                 FitError)
        << "a k 36 % too high is not given out without a decision";
  }
  EXPECT_EQ(disagreeing, (std::map<std::size_t, int>{{1, 2}})) << "one row each in two of three files";
}

TEST_F(RealData, OfTheRampWasNeverTared) {
  const auto all = findings_of(folder + "rcb1780-timeseries");
  const auto& found = all.at("Polar_2021-06-18_140528");
  ASSERT_NE(find(found, FindingKind::untared), nullptr);
  EXPECT_EQ(find(found, FindingKind::untared)->rows, 252u);
  EXPECT_THAT(find(found, FindingKind::untared)->text, HasSubstr("-4.104 N"));
  EXPECT_THAT(find(found, FindingKind::zero_drifted)->text, HasSubstr("-4.011 N after (41 rows, sd 0.009 N)"));
  EXPECT_EQ(find(found, FindingKind::not_turning)->rows, 71u);
  EXPECT_EQ(find(found, FindingKind::coasting)->rows, 90u);
  EXPECT_EQ(find(found, FindingKind::time_repeated)->rows, 1u);
  EXPECT_NE(find(found, FindingKind::correlated_noise), nullptr);
  EXPECT_EQ(find(found, FindingKind::thrust_drifts), nullptr) << "its plateau holds";
  EXPECT_EQ(find(found, FindingKind::speed_spike), nullptr);
}

TEST_F(RealData, OfConstantSpeedDriftsSpikesAndGoesBackInTime) {
  const auto all = findings_of(folder + "rcb1780-timeseries");
  const auto& constant = all.at("ConstVel_2021-06-17_084922");
  EXPECT_EQ(find(constant, FindingKind::time_backward)->rows, 591u);
  EXPECT_THAT(find(constant, FindingKind::time_backward)->text, HasSubstr("306.011 s"));
  EXPECT_NE(find(constant, FindingKind::thrust_drifts), nullptr);
  EXPECT_NE(find(constant, FindingKind::zero_missing), nullptr);
  EXPECT_EQ(find(constant, FindingKind::other_fields)->first_line, 2u) << "the message with unquoted commas";
  const auto& run = all.at("Run_142_Constant_RPM_2021-11-19_163918");
  EXPECT_EQ(find(run, FindingKind::speed_spike)->rows, 156u);
  EXPECT_THAT(find(run, FindingKind::speed_spike)->text, HasSubstr("59504"));
  EXPECT_EQ(find(run, FindingKind::negative_thrust)->rows, 540u);
  EXPECT_EQ(find(run, FindingKind::time_backward)->rows, 151u);
  EXPECT_EQ(find(run, FindingKind::time_repeated)->rows, 1u);
  EXPECT_NE(find(run, FindingKind::thrust_drifts), nullptr);
  EXPECT_NE(find(run, FindingKind::zero_missing), nullptr);
}

TEST_F(RealData, OfUiucIsClean) {
  for (const char* file : {"apcff_4.2x4_static_0615rd.txt", "apcsf_10x7_static_kt0827.txt"}) {
    const Import import = import_table(results::read_text(folder + "uiuc/" + file), file, {});
    EXPECT_TRUE(import.findings.empty());
    EXPECT_FALSE(import.table.steps.empty());
  }
}

TEST_F(RealData, ReportTheLineWithUnquotedCommas) {
  const std::string path = folder + "rcb1780-timeseries/ConstVel_2021-06-17_084922.csv";
  const StandLog log = read_rcbenchmark(results::read_text(path), path);
  ASSERT_EQ(log.problems.size(), 1u);
  EXPECT_EQ(log.problems[0].line, 2u);
  EXPECT_EQ(log.rows.size(), 4022u);
}

}  // namespace
}  // namespace kphi::fit
