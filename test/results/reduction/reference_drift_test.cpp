#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "results/reduction/repetitions.hpp"

namespace kphi::results {
namespace reference_drift_test {

/// Reference runs -1, -2, …; run i has the coefficient 1.3e-6 · (1 + off[i]), in air of density[i] if given.
std::vector<StepMean> runs(const std::vector<double>& off, const std::vector<double>& density = {}, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.002);
  std::vector<StepMean> steps;
  for (std::size_t run = 0; run < off.size(); ++run) {
    for (int i = 0; i < 20; ++i) {
      StepMean s;
      s.propeller = "5x3";
      s.repetition = -1 - static_cast<int>(run);
      s.step = i;
      s.speed_rad_s = 200 + 90.0 * i;
      s.thrust_n = 1.3e-6 * (1 + off[run]) * s.speed_rad_s * s.speed_rad_s + noise(random);
      s.thrust_u_n = 0.002;
      s.thrust_freedom = 30;
      s.zero_u_n = 0;
      if (!density.empty()) s.air_density_kg_m3 = density[run];
      steps.push_back(s);
    }
  }
  return steps;
}

TEST(ReferenceDrift, IsSeenFromTheFirstRunToTheLast) {
  const auto drift = reference_drift(runs({0, 0.5, -0.02}));
  ASSERT_TRUE(drift);
  EXPECT_NEAR(drift->share, -0.02, 4 * drift->u_share);
  EXPECT_LT(drift->u_share, 0.002);
  EXPECT_TRUE(drift->drifted());
  EXPECT_THAT(drift->to_words(), testing::HasSubstr("the bench has drifted"));
}

TEST(ReferenceDrift, IsNoneWithinHalfAPercentOrItsUncertainty) {
  const auto drift = reference_drift(runs({0, 0.003}));
  ASSERT_TRUE(drift);
  EXPECT_FALSE(drift->drifted());
  EXPECT_GT(drift->share, 2 * drift->u_share) << "significant, but small";
  EXPECT_THAT(drift->to_words(), testing::EndsWith(" %"));
}

TEST(ReferenceDrift, IsHeldAgainstTheAirWhereItIsKnownOfBothRuns) {
  const auto thinner = reference_drift(runs({0, -0.03}, {1.2, 1.2 * 0.97}));
  ASSERT_TRUE(thinner && thinner->same_air);
  EXPECT_FALSE(thinner->drifted()) << thinner->to_words();
  EXPECT_FALSE(reference_drift(runs({0, -0.03}, {1.2, std::nan("")}))->same_air);
  EXPECT_TRUE(reference_drift(runs({0, -0.03}))->drifted());
}

TEST(ReferenceDrift, IsUnknownWithoutTwoGoodRuns) {
  EXPECT_FALSE(reference_drift(runs({0})));
  EXPECT_FALSE(reference_drift({}));
  auto steps = runs({0, 0.02});
  for (StepMean& step : steps) {
    if (step.repetition == -2) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::zero_drifted);
  }
  EXPECT_FALSE(reference_drift(steps));
}

}  // namespace reference_drift_test
}  // namespace kphi::results
