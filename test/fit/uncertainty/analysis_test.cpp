#include "fit/uncertainty/analysis.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "compensation/file/coefficient_file.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/report/fit_summary.hpp"
#include "test/fit/bench_study.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace analysis_test {

using ::testing::HasSubstr;

const BudgetRow& row_of(const Budget& budget, const std::string& source) {
  for (const BudgetRow& row : budget.rows)
    if (row.source == source) return row;
  throw std::out_of_range(source);
}

struct StudyAnalysis : testing::Test {
  StudyCampaign campaign = study_campaign({}, 5);
  Identification found = identify(campaign.steps);
  AnalysisOptions options = study_options({});
  const Analysis analysis = analyse(found, options);
};

TEST_F(StudyAnalysis, ABudgetHasEverySourceAndSaysWhatIsAssumed) {
  const Budget budget = analysis.coefficients[1];
  EXPECT_EQ(budget.quantity, "k(45 deg)");
  for (const char* source : {"noise within runs", "repetitions", "zero", "model T = k w^2", "cell calibration",
                             "cross-axis", "alignment", "motor clock"})
    EXPECT_NO_THROW((void)row_of(budget, source)) << source;
  EXPECT_FALSE(row_of(budget, "motor clock").assumed) << "the study knows it";
  EXPECT_TRUE(row_of(analyse(found).coefficients[1], "cross-axis").assumed);
  EXPECT_NEAR(row_of(analyse(found).coefficients[1], "cross-axis").contribution(), 0.002 * budget.value, 1e-18);
  EXPECT_LT(row_of(budget, "repetitions").freedom, 10) << "five angles, three runs each, less what noise hides";
  EXPECT_GE(row_of(budget, "repetitions").freedom, 1);
  EXPECT_NEAR(row_of(budget, "motor clock").contribution(), 2 * 2e-4 * budget.value, 1e-18);
  EXPECT_NEAR(row_of(budget, "cell calibration").contribution(), 2e-3 * budget.value, 1e-18);
  double shares = 0;
  for (const BudgetRow& row : budget.rows) shares += budget.share(row);
  EXPECT_NEAR(shares, 1, 1e-12);
}

TEST_F(StudyAnalysis, AssumesTheUsualSizesWhereNobodyMeasured) {
  const Budget K_T = analyse(found).coefficients[0];
  const double two_degrees = 2 * kPi / 180;
  for (const auto& [source, share] :
       std::vector<std::pair<const char*, double>>{{"cell calibration", 0.006},
                                                   {"cross-axis", 0.002},
                                                   {"alignment", two_degrees * two_degrees / std::sqrt(2.0)},
                                                   {"motor clock", 2 * 0.002}}) {
    EXPECT_TRUE(row_of(K_T, source).assumed) << source;
    EXPECT_NEAR(row_of(K_T, source).contribution() / K_T.value, share, 1e-12) << source;
  }
}

TEST_F(StudyAnalysis, TheZerosOwnUncertaintyIsInEveryK) {
  for (results::StepMean& step : campaign.steps) step.zero_u_n = 0.05;
  const Analysis after = analyse(identify(campaign.steps), options);
  for (std::size_t i = 0; i < analysis.coefficients.size(); ++i) {
    const double u = row_of(after.coefficients[i], "zero").u;
    EXPECT_NEAR(u, 0.05 / std::sqrt(3.0), 1e-12) << "three runs; zeros that noisy explain how far they are apart";
    EXPECT_GT(after.coefficients[i].combined(), analysis.coefficients[i].combined() * 0.9);
  }
}

TEST_F(StudyAnalysis, WhatIsCommonToAllCancelsInTheScalingFactor) {
  options.bench.cell_calibration = 0.5;
  options.bench.motor_clock = 0.5;
  options.bench.alignment_rad = 0.02;
  const Analysis after = analyse(found, options);
  EXPECT_GT(after.coefficients[0].combined(), 0.4 * after.coefficients[0].value);
  EXPECT_GT(after.predictions[0].speed_u_share, 0.2);
  const Budget& k = after.coefficients[0];
  EXPECT_NEAR(row_of(k, "alignment").contribution() / k.value, 0.02 * 0.02 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(after.predictions[0].scaling_factor.combined() / analysis.predictions[0].scaling_factor.combined(), 1,
              1e-9);
}

TEST_F(StudyAnalysis, CovarianceBelongsToTheBudgets) {
  EXPECT_NEAR(std::sqrt(analysis.covariance[0][0]) / analysis.coefficients[0].combined(), 1, 1e-12);
  EXPECT_NEAR(std::sqrt(analysis.covariance[1][1]) / analysis.parameters[0].combined(), 1, 1e-9);
  EXPECT_NEAR(std::sqrt(analysis.covariance[2][2]) / analysis.parameters[1].combined(), 1, 1e-9);
  EXPECT_LT(analysis.covariance[1][2], 0);
}

TEST_F(StudyAnalysis, StandardAirAddsTheDensity) {
  const double scale = kStandardDensity / campaign.measured_density;
  EXPECT_NEAR(analysis.standard[0].value / (analysis.coefficients[0].value * scale), 1, 1e-12);
  EXPECT_NEAR(row_of(analysis.standard[0], "cell calibration").contribution(), 2e-3 * analysis.standard[0].value,
              1e-17);
  EXPECT_NEAR(row_of(analysis.standard[0], "air density").contribution(), 3e-3 * analysis.standard[0].value, 1e-17);
  found.table[1].air.reset();
  EXPECT_TRUE(analyse(found, options).standard.empty()) << "never 1.225 in silence";
}

TEST_F(StudyAnalysis, ReportsWhatEquationFourWillMeet) {
  ASSERT_TRUE(analysis.shape.clipping_deg);
  EXPECT_NEAR(*analysis.shape.clipping_deg, 10.4, 4);
  EXPECT_NEAR(*analysis.shape.zero_deg, 356.5, 4);
  EXPECT_GT(analysis.shape.mismatch.value, 0);
  EXPECT_THAT(analysis.remarks, ::testing::Contains(HasSubstr("k_i is held at 1")));
  EXPECT_THAT(analysis.remarks, ::testing::Contains(HasSubstr("reaches 0 at")));
}

TEST_F(StudyAnalysis, TorqueFollowsTheSameEstimators) {
  ASSERT_EQ(analysis.torque.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_NEAR(analysis.torque[i].drag_per_thrust_m.value, 0.013, 4 * analysis.torque[i].drag_per_thrust_m.u + 1e-5);
  EXPECT_EQ(analysis.torque[0].share.value, 1);
  EXPECT_LT(analysis.torque[4].share.value, 0.3);
}

double u_share(const Budget& budget) { return budget.combined() / budget.value; }
double u_share(const Estimate& estimate) { return estimate.u / estimate.value; }

TEST(TorqueCoefficient, HasTheErrorsOfTheStandAndItsRatiosOnlyThoseThatDoNotCancel) {
  const Identification found = identify(study_campaign({}, 7).steps);
  const auto with = [&](BenchUncertainty bench) { return torque_coefficients(found, bench).back(); };
  BenchUncertainty none = BenchUncertainty::none(), clock = none, cell = none, mounting = none;
  const TorqueCoefficient quiet = with(none);
  clock.motor_clock = 0.01;
  EXPECT_NEAR(u_share(with(clock).k_q), std::hypot(u_share(quiet.k_q), 0.02), 1e-9);
  EXPECT_NEAR(u_share(with(clock).share), u_share(quiet.share), 1e-9);
  EXPECT_NEAR(u_share(with(clock).drag_per_thrust_m), u_share(quiet.drag_per_thrust_m), 1e-9)
      << "thrust and torque belong to the same speed";
  cell.cell_calibration = 0.01;
  EXPECT_NEAR(u_share(with(cell).share), u_share(quiet.share), 1e-9);
  EXPECT_NEAR(u_share(with(cell).drag_per_thrust_m),
              std::hypot(u_share(quiet.drag_per_thrust_m), 0.01 * std::numbers::sqrt2), 1e-9)
      << "one axis each";
  cell.calibration_note = "weighed";
  cell.cell_calibration = 1e-4;
  EXPECT_NEAR(u_share(with(cell).k_q), std::hypot(u_share(quiet.k_q), 0.006), 1e-9)
      << "a weight hangs on the thrust's axis; the torque's is assumed";
}

TEST(TorqueCoefficient, OfOneRunEachDoesNotKnowItsZero) {
  auto steps = study_campaign({}, 7).steps;
  std::erase_if(steps, [](const auto& step) { return step.repetition > 1; });
  const auto torque = torque_coefficients(identify(steps), {});
  EXPECT_THAT(torque.front().k_q.not_known(), ::testing::ElementsAre("zero"));
  EXPECT_THAT(torque.front().k_q.assumed(), ::testing::Contains("repetitions"));
}

TEST(Analysis, OneRunEachTakesTheUsualScatterOfMountings) {
  auto steps = study_campaign({}, 7).steps;
  std::erase_if(steps, [](const auto& step) { return step.repetition > 1; });
  const Analysis analysis = analyse(identify(steps));
  EXPECT_TRUE(row_of(analysis.coefficients[0], "repetitions").assumed);
  EXPECT_NEAR(row_of(analysis.coefficients[0], "repetitions").contribution() / analysis.coefficients[0].value,
              kAssumedMounting, 1e-12);
  EXPECT_FALSE(analysis.speed[0].lack_of_fit.tested());
  for (const SpeedDependence& one : analysis.speed) EXPECT_EQ(one.inadequacy > 0, one.depends()) << one.phi_deg;
  EXPECT_TRUE(analysis.speed[0].trend.tested());
}

TEST(Analysis, OneRunEachTakesTheScatterOfMountingsAsGiven) {
  std::vector<results::StepMean> steps = campaign_steps();
  std::erase_if(steps, [](const results::StepMean& step) { return step.repetition > 1; });
  const Identification found = identify(steps, {.mounting = 0.003});
  AnalysisOptions options;
  options.bench.mounting = 0.003;
  const Analysis analysis = analyse(found, options);
  const BudgetRow& row = row_of(analysis.coefficients[1], "repetitions");
  EXPECT_EQ(row.evaluation, Evaluation::type_b);
  EXPECT_NEAR(row.contribution() / found.table[1].k, 0.003, 1e-12);
  EXPECT_GT(found.table[1].standard_error, 0.003 * found.table[1].k) << "the line and its test allow for it";
  EXPECT_FALSE(row.assumed);
  EXPECT_EQ(identify(campaign_steps(), {.mounting = 0.5}).repeatability.between.u,
            identify(campaign_steps()).repeatability.between.u)
      << "repetitions tell it better";
}

TEST(Analysis, PlatesMountedOnceTakeTheUsualScatterOfMountingsHoweverManyRuns) {
  const Identification unknown = identify(campaign_steps(), {.mounted_once = true});
  const auto budget = analyse(unknown).coefficients[1];
  EXPECT_NEAR(row_of(budget, "mounting").contribution() / unknown.table[1].k, kAssumedMounting, 1e-12);
  EXPECT_FALSE(row_of(budget, "repetitions").assumed);
  EXPECT_THAT(budget.assumed(), testing::Contains("mounting"));

  const Identification given = identify(campaign_steps(), {.mounting = 0.003, .mounted_once = true});
  EXPECT_NEAR(row_of(analyse(given).coefficients[1], "mounting").contribution() / given.table[1].k, 0.003, 1e-12);
  const Identification none = identify(campaign_steps(), {.mounting = 0, .mounted_once = true});
  EXPECT_NEAR(given.table[1].standard_error, std::hypot(none.table[1].standard_error, 0.003 * given.table[1].k), 1e-15)
      << "the line and its test allow for it";

  const auto remounted = analyse(identify(campaign_steps())).coefficients[1];
  EXPECT_TRUE(std::ranges::none_of(remounted.rows, [](const BudgetRow& row) { return row.source == "mounting"; }))
      << "their repetitions hold it";
}

TEST(Analysis, OfATableUsesItsOwnErrors) {
  const std::vector<CurvePoint> points{{0, 1.5e-6, 1e-8}, {90, 1.2e-6, 1e-8}, {180, 0.8e-6, 2e-8}, {270, 0.4e-6, 1e-8}};
  const Analysis analysis = analyse(identify_table(points, {.speed_range = {300, 2000}}));
  EXPECT_NEAR(analysis.coefficients[2].combined(), 2e-8, 1e-20);
  EXPECT_NEAR(analysis.shape.mismatch.u, std::hypot(analysis.parameters[0].combined(), 1e-8), 1e-18);
  EXPECT_TRUE(analysis.speed.empty());
  EXPECT_TRUE(analysis.torque.empty());
  EXPECT_TRUE(analysis.curvature.lack_of_fit.tested());
}

TEST(Analysis, OfATableWithoutErrorsInventsNone) {
  const std::vector<CurvePoint> points{{0, 1.5}, {45, 1.38}, {90, 1.21}, {180, 0.82}, {270, 0.39}};
  const Fitted fitted = analysed(identify_table(points, {.speed_range = {300, 2000}}));
  const Analysis& analysis = fitted.analysis;
  EXPECT_TRUE(std::isnan(analysis.coefficients[0].combined()));
  // Ordinary least squares: the standard errors by the scatter about the line.
  EXPECT_NEAR(analysis.parameters[0].combined(), 0.021678357028584474, 1e-14);
  EXPECT_NEAR(analysis.parameters[1].combined(), 0.00012761637925497133, 1e-16);
  EXPECT_EQ(analysis.parameters[1].freedom(), 2);
  EXPECT_NEAR(analysis.covariance[1][2], -2.3818187621692447e-06, 1e-18);
  EXPECT_TRUE(std::isnan(analysis.shape.mismatch.u)) << "K_T's error is unknown";
  EXPECT_EQ(analysis.flight.readiness(), Readiness::with_care);
  EXPECT_TRUE(std::isnan(analysis.flight.error.share)) << "nobody knows it";
  const std::string file = format_coefficients(fitted, {});
  EXPECT_THAT(file, testing::HasSubstr("covariance: unknown"));
  EXPECT_FALSE(compensation::parse_coefficients(file, "k.yaml").curve.has_uncertainty());
  const std::vector<CurvePoint> two{{0, 1.5}, {45, 1.38}, {90, 1.21}};
  EXPECT_TRUE(std::isnan(analyse(identify_table(two, {})).parameters[0].combined())) << "no scatter about two points";
}

TEST(Analysis, ListsThePointsThatTheLossIgnored) {
  auto steps = study_campaign({}, 8).steps;
  steps[35].thrust_n *= 3;
  const Analysis analysis = analyse(identify(steps, {.loss = Loss::tukey}));
  EXPECT_TRUE(std::ranges::any_of(analysis.rejected, [](const RejectedPoint& point) {
    return point.phi_deg == 0 && point.repetition == 1 && point.step == 35 && point.robust_weight == 0;
  }));
}

TEST_F(StudyAnalysis, NeighbouringOcclusionsDiffer) {
  ASSERT_EQ(analysis.differences.size(), 4u);
  for (const HypothesisTest& test : analysis.differences) EXPECT_TRUE(test.rejected()) << test.name;
}

TEST_F(StudyAnalysis, IsWrittenWithoutWhatJsonCannotHold) {
  const std::string text = nlohmann::ordered_json(analysis).dump();
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("inf"), std::string::npos);
  EXPECT_THAT(text, HasSubstr("\"source\":\"zero\""));
  const std::string yaml = format_coefficients({found, analysis}, {});
  EXPECT_THAT(yaml, HasSubstr("not_known: []"));
  EXPECT_THAT(yaml, HasSubstr("assumed: []")) << "the study knows its stand";
  EXPECT_THAT(format_coefficients(analysed(found), {}),
              HasSubstr("assumed: [cell calibration, cross-axis, alignment, motor clock]"));
  EXPECT_EQ(yaml, format_coefficients({found, analysis}, {}));
}

}  // namespace analysis_test
}  // namespace kphi::fit
