#include "results/reduction/repetitions.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>

#include "test/results/reduction/repeated_runs.hpp"

namespace kphi::results::repetitions_test {
using namespace testing;

using test::runs;

RepetitionVerdict judged(const std::vector<StepMean>& steps, const RepetitionRule& rule = {}) {
  const auto verdicts = judge_repetitions(steps, rule);
  EXPECT_EQ(verdicts.size(), 1u);
  return verdicts.at(0);
}

TEST(JudgeRepetitions, IsContentWithThreeThatAgree) {
  int large = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto verdict = judged(runs({0, 0, 0}, seed));
    EXPECT_FALSE(verdict.asks_for_another) << seed << ": " << verdict.reason;
    EXPECT_NEAR(verdict.k, 1.5e-6, 1.5e-6 * 0.001);
    large += verdict.p < 0.05;
  }
  EXPECT_LE(large, 22) << "one in twenty by chance";
  EXPECT_GE(large, 2);
}

TEST(JudgeRepetitions, TellsTheSpreadBetweenFromTheSpreadWithin) {
  const auto verdict = judged(runs({-0.004, 0, 0.004}));
  EXPECT_NEAR(verdict.between_sd, 0.004 * 1.5e-6, 0.0005 * 1.5e-6);
  EXPECT_LT(verdict.within_u, 0.0005 * 1.5e-6);
  EXPECT_GT(verdict.f, 30);
  EXPECT_LT(verdict.p, 0.001);
  EXPECT_FALSE(verdict.asks_for_another) << "0.8 % from end to end is what mounting and air do";
}

TEST(JudgeRepetitions, AsksForAnotherWhenOneOfThreeStandsOutAndKeepsIt) {
  const auto verdict = judged(runs({0, 0.03, 0.0005}));
  EXPECT_TRUE(verdict.asks_for_another);
  EXPECT_THAT(verdict.reason, HasSubstr("repetition 2"));
  ASSERT_EQ(verdict.repetitions.size(), 3u);
  EXPECT_TRUE(verdict.repetitions[1].outlying);
  EXPECT_NEAR(verdict.repetitions[1].k, 1.03 * 1.5e-6, 0.001 * 1.5e-6);
  EXPECT_FALSE(verdict.repetitions[0].outlying);

  const auto after = judged(runs({0, 0.03, 0.0005, -0.0003}));
  EXPECT_FALSE(after.asks_for_another) << "three are good now";
  EXPECT_TRUE(after.repetitions[1].outlying) << "and the failed one is still there";
  EXPECT_THAT(after.reason, HasSubstr("repetition 2"));
}

TEST(JudgeRepetitions, AsksForAnotherWhenNoneAgreesButNotForEver) {
  EXPECT_TRUE(judged(runs({-0.03, 0, 0.03})).asks_for_another);
  EXPECT_THAT(judged(runs({-0.03, 0, 0.03})).reason, HasSubstr("none stands out"));
  EXPECT_FALSE(judged(runs({-0.06, -0.03, 0, 0.03, 0.06})).asks_for_another);
}

TEST(JudgeRepetitions, AsksForAnotherWhenOneHasTooManyFlaggedSteps) {
  auto steps = runs({0, 0, 0});
  for (auto& step : steps) {
    if (step.repetition == 3 && step.step < 11) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::unsettled);
  }
  const auto verdict = judged(steps);
  EXPECT_TRUE(verdict.asks_for_another);
  EXPECT_FALSE(verdict.repetitions[2].usable);
  for (auto& step : steps) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::coil_hot);
  EXPECT_FALSE(judged(steps).asks_for_another) << "a hot coil changes no coefficient";
}

TEST(JudgeRepetitions, ComparesOnlyLevelsThatAllHave) {
  auto steps = runs({0, 0, 0});
  for (auto& step : steps) {
    // k rises with speed; one run lacks its fast steps.
    step.thrust_n *= 1 + 1e-4 * step.speed_rad_s;
    if (step.repetition == 2 && step.step > 12) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::derated);
  }
  EXPECT_FALSE(judged(steps).repetitions[1].outlying);
}

/// `off` at occlusion 0, and four occlusions more whose runs scatter by `scatter`.
std::vector<StepMean> campaign(const std::vector<double>& off, double scatter, unsigned seed = 1) {
  std::mt19937 random(100 + seed);
  std::normal_distribution<double> normal(0, scatter);
  std::vector<StepMean> steps = runs(off, seed);
  for (const double phi : {45.0, 90.0, 180.0, 270.0}) {
    for (StepMean step : runs({normal(random), normal(random), normal(random)}, seed + static_cast<unsigned>(phi))) {
      step.occlusion_deg = phi;
      steps.push_back(step);
    }
  }
  return steps;
}

TEST(JudgeRepetitions, LearnsFromTheOtherOcclusionsHowMuchRunsScatter) {
  EXPECT_TRUE(judged(runs({0, 0.0001, 0.006})).repetitions[2].outlying) << "alone: two that agree make the third odd";
  for (const auto& verdict : judge_repetitions(campaign({0, 0.0001, 0.006}, 0.003)))
    for (const RepetitionFigure& run : verdict.repetitions) EXPECT_FALSE(run.outlying) << run.p;
  const auto verdicts = judge_repetitions(campaign({0, 0.0001, 0.03}, 0.003));
  EXPECT_TRUE(verdicts.at(0).repetitions[2].outlying);
  EXPECT_NEAR(verdicts.at(0).repetitions[2].away, 0.03, 0.001);
  EXPECT_LT(verdicts.at(0).repetitions[2].p, 0.01);
  EXPECT_THAT(verdicts.at(0).reason, HasSubstr("repetition 3 gives a k that is +3.0"));
}

/// The zero of each run jumps once, at any step, by `jump_n` standard; the line between the two zeros misses the jump.
void let_zeros_jump(std::vector<StepMean>& steps, double jump_n, std::mt19937& random) {
  std::normal_distribution<double> normal(0, jump_n);
  std::uniform_real_distribution<double> uniform;
  for (std::size_t first = 0; first < steps.size(); first += 20) {
    const double moved = normal(random), jump = uniform(random);
    for (std::size_t i = 0; i < 20; ++i) {
      const double part = (static_cast<double>(i) + 0.5) / 20;
      steps[first + i].zero_n = 0.3 + moved * part;
      steps[first + i].thrust_n += moved * ((part > jump ? 1.0 : 0.0) - part);
    }
  }
}

TEST(JudgeRepetitions, CallsARunOutlyingByChanceInOneCampaignOfTwenty) {
  for (const double jump_n : {0.0, 0.05}) {
    int called = 0;
    for (unsigned seed = 1; seed <= 200; ++seed) {
      std::mt19937 random(seed);
      std::normal_distribution<double> normal(0, 0.003);
      auto steps = campaign({normal(random), normal(random), normal(random)}, 0.003, seed);
      let_zeros_jump(steps, jump_n, random);
      bool any = false;
      for (const auto& verdict : judge_repetitions(steps))
        for (const RepetitionFigure& run : verdict.repetitions) any = any || run.outlying;
      called += any;
    }
    EXPECT_GE(called, jump_n > 0 ? 0 : 2) << "a jump is off by half of it at most: it hardly goes beyond its own error";
    EXPECT_LE(called, 18) << jump_n;
  }
}

TEST(JudgeRepetitions, CountsHowFarZerosUsuallyMoveOverGoodSteps) {
  auto steps = runs({0, 0});
  const double quiet = judged(steps).repetitions[0].u;
  for (auto& step : steps) step.zero_n = 0.3 + (step.repetition == 1 ? 0.01 * step.step / 19.0 : 0.0);
  double x = 0, xx = 0;
  for (const auto& step : runs({0})) x += std::pow(step.speed_rad_s, 2), xx += std::pow(step.speed_rad_s, 4);
  const double usual = 0.01 / std::sqrt(2.0);
  const auto u_by = [&](double own) {
    return std::hypot(quiet, std::hypot(usual, own) / std::sqrt(2.0) / std::sqrt(12.0) * x / xx);
  };
  EXPECT_NEAR(judged(steps).repetitions[0].u, u_by(0.01), 1e-15);
  EXPECT_NEAR(judged(steps).repetitions[1].u, u_by(0), 1e-15) << "the zero may have come back by chance";
  steps[0].zero_n = 5;
  steps[0].quality_flags = static_cast<std::uint32_t>(QualityFlag::rebooted);
  EXPECT_LT(judged(steps).repetitions[0].u, 1.01 * u_by(0.01));
}

TEST(JudgeRepetitions, NeverCallsAThousandthOutlying) {
  for (const auto& verdict : judge_repetitions(campaign({0, 0, 0.002}, 0.00001)))
    for (const RepetitionFigure& run : verdict.repetitions) EXPECT_FALSE(run.outlying);
}

TEST(JudgeRepetitions, WaitsUntilTheWantedOnesAreThere) {
  EXPECT_FALSE(judged(runs({0})).asks_for_another);
  EXPECT_FALSE(judged(runs({0, 0.05})).asks_for_another);
  EXPECT_FALSE(judged(runs({0}), {.wanted = 1}).asks_for_another);
}

}  // namespace kphi::results::repetitions_test
