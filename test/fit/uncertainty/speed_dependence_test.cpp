#include "fit/uncertainty/speed_dependence.hpp"

#include <gtest/gtest.h>

#include <map>
#include <random>

#include "results/reduction/run_scatter.hpp"
#include "results/reduction/run_zero.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace speed_dependence_test {

using Steps = std::vector<results::StepMean>;

std::vector<SpeedDependence> all_of(const Steps& steps) {
  std::map<double, Steps> by_angle;
  for (const auto& step : steps)
    if (step.step >= 7) by_angle[step.occlusion_deg].push_back(step);
  std::vector<OcclusionCoefficient> table;
  for (const auto& [phi, of_angle] : by_angle) table.push_back({.phi_deg = phi, .measured = of_angle});
  results::ZeroMovement movement;
  for (const results::StepMean& step : steps) movement.add(step);
  return speed_dependence(table, {movement.usual_n(), 0, movement.runs()});
}

Steps risen(Steps steps, double rise) {
  for (auto& step : steps) step.thrust_n *= 1 + rise * (step.step - 23) / 32.0;
  return steps;
}

constexpr double kZero_n = 0.01;

/// Every run has a zero error of its own, of one standard deviation kZero_n.
Steps with_shared_zeros(Steps steps, unsigned seed, bool told) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::map<std::pair<double, int>, double> zeros;
  for (auto& step : steps) {
    const auto [zero, fresh] = zeros.try_emplace({step.occlusion_deg, step.repetition}, 0);
    if (fresh) zero->second = kZero_n * normal(random);
    step.thrust_n += zero->second;
    if (told) step.zero_u_n = kZero_n;
  }
  return steps;
}

/// In percent of all φ of all campaigns.
struct Verdicts {
  double lack = 0, trend = 0, depends = 0, draws = 0;
  void add(const std::vector<SpeedDependence>& found) {
    for (const SpeedDependence& one : found) {
      ++draws;
      lack += one.lack_of_fit.rejected() ? 1 : 0;
      trend += one.trend.rejected() ? 1 : 0;
      depends += one.depends() ? 1 : 0;
    }
  }
  [[nodiscard]] double percent(double Verdicts::*count) const { return 100 * this->*count / draws; }
};

void expect_one_in_twenty(const Verdicts& verdicts) {
  for (const auto count : {&Verdicts::lack, &Verdicts::trend}) {
    EXPECT_GE(verdicts.percent(count), 2);
    EXPECT_LE(verdicts.percent(count), 7);
  }
  EXPECT_LE(verdicts.percent(&Verdicts::depends), 7);
}

TEST(SpeedDependence, FindsTheRiseOfARealPropeller) {
  const SpeedDependence found = all_of(risen(campaign_steps(), 0.15)).front();
  EXPECT_NEAR(found.change.value, 0.15, 0.01);
  EXPECT_TRUE(found.lack_of_fit.rejected());
  EXPECT_TRUE(found.trend.rejected());
  // Weighted in ω⁴ the k of the range belongs to 0.8 of it: 0.15 √(1/12 + 0.3²).
  EXPECT_NEAR(found.inadequacy / 1.55e-6, 0.064, 0.003) << "± 13 %: the slowest rotor is within it";
  ASSERT_EQ(found.levels.size(), 33u);
  EXPECT_GT(found.levels.back().k, 1.1 * found.levels.front().k);
}

TEST(SpeedDependence, TakesTheZeroThatARunSharesForNoTrendInNineteenOfTwenty) {
  Verdicts told, untold;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    told.add(all_of(with_shared_zeros(campaign_steps({}, seed), seed, true)));
    untold.add(all_of(with_shared_zeros(campaign_steps({}, seed), seed, false)));
  }
  expect_one_in_twenty(told);
  expect_one_in_twenty(untold);
}

TEST(SpeedDependence, TakesCorrelatedNoiseAndAWanderingZeroForNoTrendEither) {
  Verdicts verdicts;
  for (unsigned seed = 1; seed <= 200; ++seed) verdicts.add(all_of(study_campaign({}, seed).steps));
  expect_one_in_twenty(verdicts);
}

TEST(SpeedDependence, FindsABendBesideASharedZero) {
  Verdicts open, small, real;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    open.add(all_of(with_shared_zeros(risen(campaign_steps({}, seed), 0.15), seed, false)));
    small.add({all_of(with_shared_zeros(risen(campaign_steps({}, seed), 0.02), seed, true)).front()});
    real.add(all_of(study_campaign({.rise = 0.15}, seed).steps));
  }
  EXPECT_GE(open.percent(&Verdicts::depends), 95);
  EXPECT_GE(small.percent(&Verdicts::depends), 95) << "2 % at phi = 0";
  EXPECT_GE(real.percent(&Verdicts::depends), 95);
}

TEST(SpeedDependence, IsNotFooledByRunsThatDiffer) {
  Verdicts verdicts;
  for (unsigned seed = 0; seed < 50; ++seed) {
    auto steps = campaign_steps({}, seed);
    for (auto& step : steps) step.thrust_n *= 1 + 0.02 * (step.repetition - 2);
    verdicts.add(all_of(steps));
  }
  EXPECT_LE(verdicts.percent(&Verdicts::lack), 9) << "a share by which a whole run differs is no dependence";
}

TEST(SpeedDependence, OfOneRunIsJudgedByItsOwnResiduals) {
  auto steps = campaign_steps({}, 3);
  std::erase_if(steps, [](const auto& step) { return step.repetition > 1; });
  const SpeedDependence flat = all_of(steps).front(), rising = all_of(risen(steps, 0.15)).front();
  EXPECT_FALSE(flat.lack_of_fit.tested());
  EXPECT_FALSE(flat.trend.p < 0.01);
  EXPECT_LT(rising.trend.p, 1e-6);
  EXPECT_NEAR(rising.change.value, 0.15, 0.02);
}

/// The first repetition, whose zero walks at random; kphi takes a line through its ends.
Steps single_runs_with_walking_zeros(unsigned seed) {
  constexpr double kWalk_n = 0.03;  // standard deviation at the end
  std::mt19937_64 random(seed);
  std::normal_distribution<double> step_n(0, kWalk_n / std::sqrt(40.0));
  Steps steps = campaign_steps({.noise_n = 0.003}, seed);
  std::erase_if(steps, [](const auto& step) { return step.repetition > 1; });
  for (std::size_t first = 0; first < steps.size(); first += 40) {
    std::vector<double> walk{0};
    for (int i = 1; i < 40; ++i) walk.push_back(walk.back() + step_n(random));
    for (std::size_t i = 0; i < 40; ++i) {
      const double line = walk.back() * static_cast<double>(i) / 39;
      steps[first + i].thrust_n += walk[i] - line;
      steps[first + i].zero_n = 0.3 + line;
      steps[first + i].zero_u_n = 0.001;
    }
  }
  return steps;
}

TEST(SpeedDependence, OfOneRunAllowsForAZeroThatWanders) {
  Verdicts verdicts;
  for (unsigned seed = 1; seed <= 100; ++seed) verdicts.add(all_of(single_runs_with_walking_zeros(seed)));
  EXPECT_GE(verdicts.percent(&Verdicts::trend), 1);
  EXPECT_LE(verdicts.percent(&Verdicts::trend), 8);
  EXPECT_LT(all_of(risen(single_runs_with_walking_zeros(1), 0.15)).front().trend.p, 1e-3);
}

TEST(SpeedDependence, CannotTestTwoLevels) {
  auto steps = campaign_steps();
  std::erase_if(steps, [](const auto& step) { return step.step > 8; });
  const SpeedDependence found = all_of(steps).front();
  EXPECT_FALSE(found.lack_of_fit.tested());
  EXPECT_FALSE(found.trend.tested());
  EXPECT_EQ(found.levels.size(), 2u);
}

TEST(SpeedDependence, OfPerfectStepsIsNone) {
  for (const SpeedDependence& found : all_of(campaign_steps({.noise_n = 0}))) EXPECT_NEAR(found.change.value, 0, 1e-9);
}

}  // namespace speed_dependence_test
}  // namespace kphi::fit
