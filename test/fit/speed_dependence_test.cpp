#include "fit/speed_dependence.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace {

std::vector<results::StepMean> steps_at(double phi, unsigned seed, double rise = 0) {
  auto steps = campaign_steps({}, seed);
  std::erase_if(steps, [&](const auto& step) { return step.occlusion_deg != phi || step.step < 7; });
  for (auto& step : steps) step.thrust_n *= 1 + rise * (step.step - 23) / 32.0;
  return steps;
}

TEST(SpeedDependence, FindsTheRiseOfARealPropeller) {
  const SpeedDependence found = speed_dependence(0, steps_at(0, 1, 0.15));
  EXPECT_NEAR(found.change.value, 0.15, 0.01);
  EXPECT_TRUE(found.lack_of_fit.rejected());
  EXPECT_TRUE(found.trend.rejected());
  EXPECT_GT(found.inadequacy / 1.55e-6, 0.01);
  EXPECT_LT(found.inadequacy / 1.55e-6, 0.06);
  ASSERT_EQ(found.levels.size(), 33u);
  EXPECT_GT(found.levels.back().k, 1.1 * found.levels.front().k);
}

TEST(SpeedDependence, FindsNothingInAPureSquareMoreOftenThanOneInTwenty) {
  int lack = 0, trend = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const SpeedDependence found = speed_dependence(90, steps_at(90, seed));
    lack += found.lack_of_fit.rejected() ? 1 : 0;
    trend += found.trend.rejected() ? 1 : 0;
  }
  EXPECT_LE(lack, 13);
  EXPECT_LE(trend, 13);
}

TEST(SpeedDependence, IsNotFooledByRunsThatDiffer) {
  int lack = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    auto steps = steps_at(0, seed);
    for (auto& step : steps) step.thrust_n *= 1 + 0.02 * (step.repetition - 2);
    lack += speed_dependence(0, steps).lack_of_fit.rejected() ? 1 : 0;
  }
  EXPECT_LE(lack, 8) << "a share by which a whole run differs is no dependence on the speed";
}

TEST(SpeedDependence, CannotTestTwoLevels) {
  auto steps = steps_at(0, 1);
  std::erase_if(steps, [](const auto& step) { return step.step > 8; });
  const SpeedDependence found = speed_dependence(0, steps);
  EXPECT_FALSE(found.lack_of_fit.tested());
  EXPECT_EQ(found.levels.size(), 2u);
}

}  // namespace
}  // namespace kphi::fit
