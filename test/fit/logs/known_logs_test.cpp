// Known answers of the import: logs with defects, synthetic (synthetic_logs.hpp) and, if KPHI_TEST_DATA names their
// folder, real.
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
#include "fit/logs/import_table.hpp"
#include "fit/model/step_selection.hpp"
#include "fit/numerics/linear_regression.hpp"
#include "results/file_layer.hpp"
#include "test/fit/logs/synthetic_logs.hpp"

namespace kphi::fit {
namespace known_logs_test {

using ::testing::HasSubstr;

const LogFinding* find(const std::vector<LogFinding>& findings, FindingKind kind) {
  for (const LogFinding& finding : findings)
    if (finding.kind == kind) return &finding;
  return nullptr;
}

// ---- synthetic logs: with the defects of real ones, and a known truth ----------------------------------------

class KnownLogs : public ::testing::TestWithParam<std::size_t> {
 protected:
  const KnownLog log_ = known_logs().at(GetParam());
};

TEST_P(KnownLogs, GiveTheFitOfTheRowsThatMustBeTaken) {
  const ImportedTable imported = select_rows(read_log(log_.text, log_.name + ".csv"), log_.selection);
  EXPECT_EQ(imported.rows_total, log_.rows_total);
  ASSERT_EQ(imported.size(), log_.used.size());
  const ThrustFit origin = fit_thrust(points_of(imported));
  const ThrustFit offset = fit_thrust(points_of(imported), {.form = ThrustForm::with_offset});
  std::vector<double> squares, thrusts;
  for (const Point& point : log_.used) {
    squares.push_back(point.speed_rad_s * point.speed_rad_s);
    thrusts.push_back(point.thrust_n);
  }
  const Regression known = regress_polynomial(squares, thrusts, 1, 1),
                   line = regress_polynomial(squares, thrusts, 0, 1);
  EXPECT_NEAR(origin.parameters.k / known.estimates[0], 1, 1e-9);
  EXPECT_NEAR(origin.rms_n, known.residual_deviation, 1e-9);
  EXPECT_NEAR(origin.standard_error.k, known.standard_errors[0], 1e-9 * known.estimates[0]);
  EXPECT_NEAR(offset.parameters.k / line.estimates[1], 1, 1e-9);
  EXPECT_NEAR(offset.parameters.offset, line.estimates[0], 1e-7);
}

TEST_P(KnownLogs, HaveTheirKnownDefectsAndNoOthers) {
  const auto findings = audit(read_log(log_.text, log_.name + ".csv"), {});
  for (std::size_t i = 0; i < findings.size(); ++i)
    ASSERT_LT(i, log_.findings.size()) << name_of(findings[i].kind) << ": " << findings[i].text;
  ASSERT_EQ(findings.size(), log_.findings.size()) << "missing: " << name_of(log_.findings[findings.size()].kind);
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const KnownFinding& known = log_.findings[i];
    EXPECT_STREQ(name_of(findings[i].kind), name_of(known.kind));
    EXPECT_EQ(findings[i].rows, known.rows > 0 ? known.rows : findings[i].rows) << findings[i].text;
    EXPECT_THAT(findings[i].text, HasSubstr(known.text));
  }
}

INSTANTIATE_TEST_SUITE_P(All, KnownLogs, ::testing::Range<std::size_t>(0, known_logs().size()),
                         [](const auto& one) { return known_logs().at(one.param).name + std::to_string(one.param); });

TEST(SyntheticLogs, HaveTheTruthBehindTheirK) {
  const auto k = [](const KnownLog& log) {
    return fit_thrust(points_of(select_rows(read_log(log.text, "l.csv"), log.selection))).parameters.k;
  };
  EXPECT_NEAR(k(averaged_sweep(1.13e-6)) / 1.13e-6, 1, 1e-9);
  EXPECT_NEAR(k(two_speeds(9e-6, {.speed = SpeedSource::optical, .speed_above_rpm = 1000}, 7)) / 9e-6, 1, 1e-9);
  EXPECT_NEAR(k(untared_ramp(8e-5, 3)) / 8e-5, 1, 3e-3) << "its zero drifts by 0.09 N of 31 N";
}

TEST(SyntheticLogs, WithTheWrongPoleCountNeedADecision) {
  const std::string text = two_speeds(9e-6, {}).text;
  EXPECT_THROW((void)import_table(text, "dyno.csv", {}), FitError) << "a k 36 % too high is not given out";
  ImportOptions options;
  options.rows.speed = SpeedSource::optical;
  EXPECT_EQ(import_table(text, "dyno.csv", options).table.size(), 15u);
}

TEST(SyntheticLogs, OfOnePropellerShowTheFilesUnlikeTheOthers) {
  std::vector<NamedCoefficient> group;
  std::set<std::string> outliers;
  for (int i = 0; i < 20; ++i) {
    const double factor = i == 4 ? 1.3 : i == 11 ? 0.88 : 1 + 0.004 * (i % 5 - 2);
    const auto imported = select_rows(read_log(averaged_sweep(1.1e-6 * factor).text, "l.csv"));
    group.push_back({std::to_string(i), fit_thrust(points_of(imported)).parameters.k});
  }
  for (const GroupOutlier& outlier : group_outliers(group)) outliers.insert(outlier.name);
  EXPECT_EQ(outliers, (std::set<std::string>{"4", "11"}));
}

TEST(SyntheticLogs, OfUiucAreClean) {
  std::string text = "RPM CT CP\n";
  for (int i = 0; i < 15; ++i) text += fmt::format("{} {} {}\n", 1500 + 300 * i, 0.11 + 1e-4 * i, 0.05);
  const Import import = import_table(text, "apcff_4.2x4_static.txt", {});
  EXPECT_TRUE(import.findings.empty());
  EXPECT_EQ(import.table.size(), 15u);
}

// ---- real logs: skipped without them -------------------------------------------------------------------------

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
  }
  return selection;
}

/// "within 0.02 of 7/6": the reference took only rows whose two sensors agree.
ImportedTable selected(StandLog log, const std::string& variant) {
  const std::size_t before = log.rows.size();
  if (variant.find("within 0.02 of 7/6") != std::string::npos)
    std::erase_if(log.rows, [](const StandRow& row) {
      return !(row.electrical_rpm.value_or(0) > 0) ||
             std::abs(row.optical_rpm.value_or(0) / *row.electrical_rpm - 7.0 / 6) > 0.02;
    });
  ImportedTable imported = select_rows(log, selection_of(variant));
  imported.rows_total += before - log.rows.size();
  return imported;
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
    const ImportedTable imported =
        file.starts_with("uiuc") ? read_uiuc(text, folder + file) : selected(read_log(text, folder + file), variant);
    EXPECT_EQ(static_cast<double>(imported.rows_total), number("rows_total"));
    ASSERT_EQ(static_cast<double>(imported.size()), number("rows_used"));
    const auto points = points_of(imported);
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

std::map<std::string, std::vector<LogFinding>> findings_of(const std::string& folder) {
  std::map<std::string, std::vector<LogFinding>> all;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".csv") continue;
    const std::string path = entry.path().string();
    all[entry.path().stem().string()] = audit(read_log(results::read_text(path), path), {});
  }
  return all;
}

struct Tally {
  std::size_t files = 0, rows = 0;
};

std::map<FindingKind, Tally> tally_of(const std::map<std::string, std::vector<LogFinding>>& all) {
  std::map<FindingKind, Tally> tally;
  for (const auto& [name, findings] : all) {
    for (const LogFinding& finding : findings) {
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
  EXPECT_EQ(tally[FindingKind::negative_thrust].rows, 1u) << "29 others are below 0 by noise alone";
  for (const char* file : {"e5_7", "f1_7", "f4_11", "f6_11", "h1_11"})
    EXPECT_NE(find(all.at(file), FindingKind::barely_turning), nullptr) << file << " has a row of 1 or 2 RPM";
  EXPECT_EQ(find(all.at("a3_11"), FindingKind::current_limit)->rows, 2u);
  const std::set<FindingKind> known{FindingKind::speed_missing, FindingKind::current_limit,
                                    FindingKind::negative_thrust, FindingKind::barely_turning,
                                    FindingKind::not_turning};
  std::size_t clean = 0;
  for (const auto& [name, findings] : all) {
    clean += findings.empty() ? 1 : 0;
    for (const LogFinding& finding : findings)
      EXPECT_TRUE(known.contains(finding.kind)) << name << ": " << finding.text;
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
      const auto imported = select_rows(read_log(results::read_text(path), path));
      group.push_back({name, fit_thrust(points_of(imported)).parameters.k});
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
    if (const LogFinding* rows = find(findings, FindingKind::speed_disagrees)) ++disagreeing[rows->rows];
    EXPECT_EQ(find(findings, FindingKind::time_backward) != nullptr, name.find("10in") != std::string::npos);
    EXPECT_THROW((void)import_table(results::read_text(folder + "rcb1585-dyno-lab/" + name + ".csv"), name, {}),
                 FitError)
        << "a k 36 % too high is not given out without a decision";
  }
  EXPECT_EQ(disagreeing, (std::map<std::size_t, int>{{1, 2}})) << "one row each in two of three files";
}

struct RealFinding {
  const char* log;
  FindingKind kind;
  std::size_t rows;  ///< 0: any number
  const char* text = "";
};

TEST_F(RealData, OfTimeSeriesHaveTheirKnownDirt) {
  constexpr const char *kRamp = "Polar_2021-06-18_140528", *kConstant = "ConstVel_2021-06-17_084922",
                       *kRun = "Run_142_Constant_RPM_2021-11-19_163918";
  const auto all = findings_of(folder + "rcb1780-timeseries");
  for (const RealFinding& known : {RealFinding{kRamp, FindingKind::untared, 252, "-4.104 N"},
                                   {kRamp, FindingKind::zero_drifted, 0, "-4.011 N after (41 rows, sd 0.009 N)"},
                                   {kRamp, FindingKind::not_turning, 71},
                                   {kRamp, FindingKind::coasting, 90},
                                   {kRamp, FindingKind::time_repeated, 1},
                                   {kRamp, FindingKind::correlated_noise, 0},
                                   {kConstant, FindingKind::time_backward, 591, "306.011 s"},
                                   {kConstant, FindingKind::thrust_drifts, 0},
                                   {kConstant, FindingKind::zero_missing, 0},
                                   {kConstant, FindingKind::other_fields, 1},
                                   {kRun, FindingKind::speed_spike, 156, "59504"},
                                   {kRun, FindingKind::negative_thrust, 534},
                                   {kRun, FindingKind::time_backward, 151},
                                   {kRun, FindingKind::time_repeated, 1},
                                   {kRun, FindingKind::thrust_drifts, 0},
                                   {kRun, FindingKind::zero_missing, 0}}) {
    const LogFinding* found = find(all.at(known.log), known.kind);
    ASSERT_NE(found, nullptr) << known.log << ": " << name_of(known.kind);
    EXPECT_EQ(found->rows, known.rows > 0 ? known.rows : found->rows) << found->text;
    EXPECT_THAT(found->text, HasSubstr(known.text));
  }
  EXPECT_EQ(find(all.at(kRamp), FindingKind::thrust_drifts), nullptr) << "its plateau holds";
  EXPECT_EQ(find(all.at(kRamp), FindingKind::speed_spike), nullptr);
  EXPECT_EQ(find(all.at(kConstant), FindingKind::other_fields)->first_line, 2u) << "the message with unquoted commas";
}

TEST_F(RealData, OfUiucIsClean) {
  for (const char* file : {"apcff_4.2x4_static_0615rd.txt", "apcsf_10x7_static_kt0827.txt"}) {
    const Import import = import_table(results::read_text(folder + "uiuc/" + file), file, {});
    EXPECT_TRUE(import.findings.empty());
    EXPECT_GT(import.table.size(), 0u);
  }
}

TEST_F(RealData, ReportTheLineWithUnquotedCommas) {
  const std::string path = folder + "rcb1780-timeseries/ConstVel_2021-06-17_084922.csv";
  const StandLog log = read_log(results::read_text(path), path);
  ASSERT_EQ(log.problems.size(), 1u);
  EXPECT_EQ(log.problems[0].line, 2u);
  EXPECT_EQ(log.rows.size(), 4022u);
}

}  // namespace known_logs_test
}  // namespace kphi::fit
