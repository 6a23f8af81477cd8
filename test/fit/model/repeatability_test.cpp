#include "fit/model/repeatability.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace repeatability_test {

using ::testing::Contains;
using ::testing::HasSubstr;

std::vector<results::StepMean> with_one_run_off(unsigned seed, double share) {
  auto steps = study_campaign({}, seed).steps;
  for (auto& step : steps)
    if (step.occlusion_deg == 90 && step.repetition == 2) step.thrust_n *= 1 + share;
  return steps;
}

TEST(OutlyingRuns, AreCalledSoByChanceInOneCampaignOfTwenty) {
  int called = 0;
  for (unsigned seed = 1; seed <= 300; ++seed)
    called += outlying_runs(identify(study_campaign({}, seed).steps).selection.used).empty() ? 0 : 1;
  EXPECT_GE(called, 0.015 * 300);
  EXPECT_LE(called, 0.08 * 300);
}

TEST(OutlyingRuns, AreNamedAndKeptAndWidenTheBudget) {
  int named = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Identification found = identify(with_one_run_off(seed, 0.03)),
                         whole = identify(study_campaign({}, seed).steps);
    const auto outlying = outlying_runs(found.selection.used);
    named += outlying.size() == 1 && outlying[0].phi_deg == 90 && outlying[0].repetition == 2 ? 1 : 0;
    EXPECT_EQ(found.selection.used.size(), whole.selection.used.size());
    EXPECT_GT(found.table[0].standard_error, whole.table[0].standard_error) << "repetitions are pooled over phi";
  }
  EXPECT_GE(named, 36) << "ten times what repetitions scatter, but zeros jump, too";
  EXPECT_THAT(analyse(identify(with_one_run_off(2, 0.03))).remarks,
              Contains(HasSubstr("repetition 2 at 90° stands out")));
}

TEST(OutlyingRuns, AreNotLookedForAmongTwo) {
  auto steps = study_campaign({}, 1).steps;
  std::erase_if(steps, [](const auto& step) { return step.occlusion_deg > 45 || step.repetition > 2; });
  EXPECT_TRUE(outlying_runs(identify(steps, {.curve = {.anchored = true}}).selection.used).empty());
}

TEST(Repeatability, AddsTheFreedomWithinTheRunsOfAllAngles) {
  AngleScatter angle;
  angle.k = 1;
  angle.runs.resize(1);
  angle.within = {1, 10};
  Repeatability both;
  both.angles = {angle, angle};
  EXPECT_NEAR(both.freedom(), 20, 1e-9);
}

TEST(LeftOutRuns, AreListedWithTheirCauseAndWeighNothing) {
  IdentificationOptions options{.left_out = {parse_left_out_run("90:2:plate slipped: seen afterwards")}};
  const Identification found = identify(with_one_run_off(1, 0.03), options);
  EXPECT_EQ(found.table[2].repetitions, 2u);
  EXPECT_EQ(
      std::ranges::count(found.selection.flagged, "by hand: plate slipped: seen afterwards", &FlaggedStep::reason), 34);
  options.left_out = {{90, 4, "not there"}};
  EXPECT_THROW((void)identify(with_one_run_off(1, 0.03), options), FitError);
}

TEST(LeftOutRuns, NeedACause) {
  for (const char* text : {"90:2", "90:2:", "90:2: ", "90", "", "x:1:y", "90:0:y", "90:1.5:y"})
    EXPECT_THROW((void)parse_left_out_run(text), ConfigurationError) << text;
}

}  // namespace repeatability_test
}  // namespace kphi::fit
