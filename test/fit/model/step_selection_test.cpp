#include "fit/model/step_selection.hpp"

#include <gtest/gtest.h>

#include "fit/model/identification.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace step_selection_test {

using results::StepMean;

StepMean step_of(double thrust_u_n, double speed_u_rad_s) {
  StepMean step;
  step.speed_rad_s = 1000;
  step.thrust_n = 1.5;
  step.thrust_sd_n = 0.1;
  step.thrust_samples = 10000;
  step.speed_sd_rad_s = 1;
  step.speed_n = 100;
  step.thrust_u_n = thrust_u_n;
  step.speed_u_rad_s = speed_u_rad_s;
  return step;
}

TEST(StepSelection, TakesTheSpeedsAtBothEndsOfTheRange) {
  EXPECT_EQ(select_steps(std::vector{step_of(0.005, 0.3)}, {1000, 1000}, {}).used.size(), 1u);
}

TEST(StepUncertainty, IsTheStepsOwnWhereAllTellItAndNeverMixed) {
  const auto points = points_of(std::vector{step_of(0.005, 0.3), step_of(0.007, 0.4)});
  EXPECT_EQ(points[0].u_thrust_n, 0.005);
  EXPECT_EQ(points[1].u_thrust_n, 0.007);
  EXPECT_EQ(points[0].u_speed_rad_s, 0.3);
  const auto mixed = points_of(std::vector{step_of(0.005, 0.3), step_of(results::kNotMeasured, 0.4)});
  EXPECT_DOUBLE_EQ(mixed[0].u_thrust_n, 0.001);
  EXPECT_DOUBLE_EQ(mixed[1].u_thrust_n, 0.001);
  EXPECT_EQ(mixed[0].u_speed_rad_s, 0.3) << "of the speed all tell";
  EXPECT_DOUBLE_EQ(points_of(std::vector{step_of(0.005, 0)})[0].u_speed_rad_s, 0.1);
}

TEST(StepUncertainty, OfCorrelatedSamplesWeighsLess) {
  // Every other step is wrong by so much as its correlated samples say, and looks as good as the rest by s/√n.
  auto steps = campaign_steps({.noise_n = 0});
  for (StepMean& step : steps) {
    const bool poor = step.step % 2 == 0;
    step.thrust_u_n = poor ? 0.05 : 0.001;
    if (poor) step.thrust_n += 0.05;
  }
  const IdentificationOptions options{.weighting = Weighting::thrust};
  const double k = CampaignTruth{}.K_T;
  EXPECT_NEAR(identify(steps, options).table[0].k / k, 1, 1e-4);
  for (StepMean& step : steps) step.thrust_u_n = results::kNotMeasured;
  EXPECT_GT(identify(steps, options).table[0].k / k, 1.004) << "s/√n knows no difference";
}

}  // namespace step_selection_test
}  // namespace kphi::fit
