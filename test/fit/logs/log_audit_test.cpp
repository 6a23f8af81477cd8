#include "fit/logs/log_audit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "compensation/units.hpp"

namespace kphi::fit {
namespace log_audit_test {

using results::QualityFlag;
using ::testing::HasSubstr;

constexpr double kK = 1.5e-6;

double thrust_of(double rpm) { return kK * from_rpm(rpm).value() * from_rpm(rpm).value(); }

/// A clean sweep of averaged steps, both speeds, a supply that sags a little.
StandLog sweep() {
  StandLog log{.path = "log.csv", .thrust_unit = "N", .has_electrical = true, .has_optical = true};
  for (int i = 0; i < 12; ++i) {
    const double rpm = 3000 + 1200.0 * i;
    StandRow row{.line = static_cast<std::uint32_t>(i) + 2, .thrust_n = thrust_of(rpm)};
    row.time_s = 5.0 * i;
    row.throttle_us = 1050 + 80.0 * i;
    row.electrical_rpm = row.optical_rpm = rpm;
    row.voltage_v = 12 - 0.05 * i;
    row.current_a = 0.1 * i * i;
    log.rows.push_back(row);
  }
  return log;
}

/// A clean time series: 40 rows still, 400 rows at 5000 RPM, 40 rows still; white noise.
StandLog series(unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.002);
  StandLog log{.path = "log.csv", .thrust_unit = "N", .has_optical = true};
  for (int i = 0; i < 480; ++i) {
    const bool turning = i >= 40 && i < 440;
    StandRow row{.line = static_cast<std::uint32_t>(i) + 2};
    row.time_s = 0.04 * i;
    row.throttle_us = turning ? 1500 : 1000;
    row.optical_rpm = turning ? 5000 + 3 * noise(random) : 0;
    row.thrust_n = (turning ? thrust_of(5000) : 0.0) + noise(random);
    log.rows.push_back(row);
  }
  return log;
}

using Names = std::vector<std::string>;

Names names(const std::vector<LogFinding>& findings) {
  Names result;
  for (const LogFinding& finding : findings) {
    if (finding.kind != FindingKind::negative_thrust) result.push_back(name_of(finding.kind));
  }
  return result;
}

Names found(const StandLog& log, const RowSelection& selection = {}) { return names(audit(log, selection)); }

/// Of each step after an import.
std::vector<std::uint32_t> flags(const StandLog& log) {
  ImportedTable table = select_rows(log);
  flag_steps(table, audit(log, {}));
  return table.quality_flags;
}

TEST(LogAudit, FindsNothingInCleanLogs) {
  EXPECT_EQ(found(sweep()), Names{});
  for (unsigned seed = 1; seed <= 20; ++seed) EXPECT_EQ(found(series(seed)), Names{}) << "seed " << seed;
}

TEST(LogAudit, NamesThePoleCountBehindARatio) {
  for (const auto& [set, actual] : {std::pair(14, 12), std::pair(12, 14), std::pair(14, 24), std::pair(8, 14)}) {
    StandLog log = sweep();
    for (StandRow& row : log.rows) row.electrical_rpm = *row.electrical_rpm * actual / set;
    const auto findings = audit(log, {});
    ASSERT_EQ(names(findings), Names{"speed_ratio"}) << set << " for " << actual;
    const auto ratio = pole_ratio(static_cast<double>(set) / actual);
    ASSERT_TRUE(ratio);
    EXPECT_EQ(ratio->numerator * actual, ratio->denominator * set);
    EXPECT_THAT(findings[0].text, HasSubstr("--speed-factor"));
  }
}

TEST(LogAudit, DoesNotInventAPoleCount) {
  for (const double none : {1.0, 1.005, 0.0, -2.0}) EXPECT_FALSE(pole_ratio(none)) << none;
  EXPECT_FALSE(pole_ratio(1.0371)) << "no ratio of small whole numbers within 0.2 %";
  EXPECT_EQ(pole_ratio(2.0)->numerator, 2);
}

TEST(LogAudit, MarksTheStepOfOneBadSpeed) {
  StandLog log = sweep();
  log.rows[6].electrical_rpm = *log.rows[6].electrical_rpm * 2;
  const auto findings = audit(log, {});
  ASSERT_EQ(names(findings), Names{"speed_disagrees"});
  EXPECT_EQ(findings[0].first_line, 8u);
  std::vector<std::uint32_t> expected(log.rows.size());
  expected[6] = static_cast<std::uint32_t>(QualityFlag::speed_unsteady);
  EXPECT_EQ(flags(log), expected);
}

TEST(LogAudit, FindsASensorThatDies) {
  StandLog log = sweep();
  for (std::size_t i = 8; i < log.rows.size(); ++i) log.rows[i].optical_rpm = 300;
  const auto findings = audit(log, {});
  ASSERT_EQ(names(findings), Names{"speed_dead"});
  EXPECT_EQ(findings[0].rows, 4u);
  for (StandRow& row : log.rows) row.optical_rpm = 0;
  EXPECT_EQ(found(log), Names{}) << "a channel that never turns is not connected";
}

TEST(LogAudit, FindsAOneSampleDoubling) {
  StandLog log = series();
  log.rows[200].optical_rpm = 10000;
  const auto findings = audit(log, {});
  ASSERT_THAT(names(findings), ::testing::Contains("speed_spike"));
  EXPECT_EQ(findings[0].rows, 1u);
  EXPECT_EQ(findings[0].first_line, 202u);
}

TEST(LogAudit, FindsTheCurrentLimit) {
  StandLog log = sweep();
  for (std::size_t i : {10u, 11u}) {
    log.rows[i].electrical_rpm = log.rows[i].optical_rpm = *log.rows[i - 1].electrical_rpm * 0.97;
    log.rows[i].thrust_n = thrust_of(*log.rows[i].electrical_rpm);
    log.rows[i].voltage_v = *log.rows[i - 1].voltage_v * 0.85;
  }
  const auto findings = audit(log, {});
  ASSERT_EQ(names(findings), Names{"current_limit"});
  EXPECT_EQ(findings[0].rows, 2u);
  EXPECT_EQ(flags(log).at(11), static_cast<std::uint32_t>(QualityFlag::supply_out_of_band));
}

TEST(LogAudit, FindsAZeroThatIsNone) {
  StandLog untared = series();
  for (StandRow& row : untared.rows) row.thrust_n -= 0.1;
  EXPECT_EQ(found(untared), Names{"untared"});
  EXPECT_EQ(found(untared, {.tare_rows = 40}), Names{}) << "the import tares";
  StandLog drifted = series();
  for (std::size_t i = 440; i < 480; ++i) drifted.rows[i].thrust_n += 0.03;
  EXPECT_EQ(found(drifted), Names{"zero_drifted"});
  StandLog noisy = series();
  for (std::size_t i = 0; i < 40; ++i) noisy.rows[i].thrust_n += i % 2 == 0 ? 0.05 : -0.05;
  EXPECT_EQ(found(noisy), Names{"zero_scatters"});
  StandLog missing = series();
  missing.rows.erase(missing.rows.begin(), missing.rows.begin() + 40);
  EXPECT_EQ(found(missing), Names{"zero_missing"});
}

TEST(LogAudit, FindsAFrozenChannel) {
  StandLog log = series();
  for (std::size_t i = 150; i < 450; ++i) log.rows[i].thrust_n = log.rows[150].thrust_n;
  EXPECT_THAT(found(log), ::testing::Contains("thrust_frozen"));
  EXPECT_EQ(flags(log).at(200), static_cast<std::uint32_t>(QualityFlag::bad_status));
  EXPECT_EQ(flags(log)[0], 0u);
}

TEST(LogAudit, CountsIndependentRows) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 1);
  const double memory = 0.9;
  std::vector<double> values{0};
  while (values.size() < 20000) values.push_back(memory * values.back() + noise(random));
  EXPECT_NEAR(correlation_time(values), (1 + memory) / (1 - memory), 5) << "of a first-order process";
  for (double& value : values) value = noise(random);
  EXPECT_NEAR(correlation_time(values), 1, 0.1);
  EXPECT_EQ(correlation_time({1, 1, 1, 1}), 1);
}

TEST(LogAudit, CountsIndependentRowsOfALongLogByItsBegin) {
  std::mt19937 random(4);
  std::normal_distribution<double> noise(0, 0.002);
  StandLog log{.path = "log.csv", .thrust_unit = "N", .has_optical = true};
  double memory = 0;
  for (std::size_t i = 0; i < 200'000; ++i) {
    memory = 0.9 * memory + noise(random);
    StandRow row{.line = static_cast<std::uint32_t>(i) + 2, .thrust_n = thrust_of(5000) + memory};
    row.optical_rpm = 5000;
    log.rows.push_back(row);
  }
  const auto findings = audit(log, {});
  const auto found = std::ranges::find(findings, FindingKind::correlated_noise, &LogFinding::kind);
  ASSERT_NE(found, findings.end());
  EXPECT_EQ(found->rows, 200'000u);
  EXPECT_THAT(found->text, HasSubstr("s/√n is 4.")) << "√19 of a first-order process";
}

TEST(LogAudit, TakesNoiseAtRestForNoNegativeThrust) {
  StandLog log = series();
  for (const LogFinding& finding : audit(log, {})) EXPECT_NE(finding.kind, FindingKind::negative_thrust);
  log.rows[100].thrust_n = -0.1;
  EXPECT_TRUE(std::ranges::any_of(audit(log, {}), [](const LogFinding& finding) {
    return finding.kind == FindingKind::negative_thrust && finding.rows == 1;
  }));
}

TEST(LogAudit, SeesThePoleCountBesideOneDoubledReading) {
  StandLog log = sweep();
  log.rows.resize(9);
  for (StandRow& row : log.rows) row.optical_rpm = *row.electrical_rpm * 7 / 6;
  log.rows[4].electrical_rpm = *log.rows[4].electrical_rpm * 2;
  const auto findings = audit(log, {});
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings.front().kind, FindingKind::speed_ratio);
  EXPECT_THAT(findings.front().text, HasSubstr("7/6"));
}

TEST(GroupOutliers, NeedAGroupAndADistance) {
  std::vector<NamedCoefficient> group;
  for (int i = 0; i < 8; ++i) group.push_back({"f" + std::to_string(i), 1e-6 * (1 + 0.01 * (i % 3))});
  EXPECT_TRUE(group_outliers(group).empty());
  group.push_back({"odd", 0.6e-6});
  const auto outliers = group_outliers(group);
  ASSERT_EQ(outliers.size(), 1u);
  EXPECT_EQ(outliers[0].name, "odd");
  EXPECT_NEAR(outliers[0].share, -0.4, 0.02);
  group.resize(4);
  EXPECT_TRUE(group_outliers(group).empty());
}

}  // namespace log_audit_test
}  // namespace kphi::fit
