#include "results/reduction/reference_drift.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "test/results/reduction/repeated_runs.hpp"

namespace kphi::results::reference_drift_test {
using namespace testing;

using test::runs;

/// Reference runs -1, -2, …, in air of density[i] if given.
std::vector<StepMean> reference_runs(const std::vector<double>& off, const std::vector<double>& density = {}) {
  auto steps = runs(off);
  for (StepMean& step : steps) {
    if (!density.empty()) step.air_density_kg_m3 = density[static_cast<std::size_t>(step.repetition - 1)];
    step.repetition = -step.repetition;
  }
  return steps;
}

TEST(ReferenceDrift, IsSeenFromTheFirstRunToTheLast) {
  const auto drift = reference_drift(reference_runs({0, 0.5, -0.02}));
  ASSERT_TRUE(drift);
  EXPECT_NEAR(drift->share, -0.02, 4 * drift->u_share);
  EXPECT_LT(drift->u_share, 0.002);
  EXPECT_TRUE(drift->drifted());
  EXPECT_THAT(drift->to_words(), testing::HasSubstr("the bench has drifted"));
}

TEST(ReferenceDrift, IsNoneWithinHalfAPercentOrItsUncertainty) {
  const auto drift = reference_drift(reference_runs({0, 0.003}));
  ASSERT_TRUE(drift);
  EXPECT_FALSE(drift->drifted());
  EXPECT_GT(drift->share, 2 * drift->u_share) << "significant, but small";
  EXPECT_THAT(drift->to_words(), testing::EndsWith(" %"));
}

TEST(ReferenceDrift, IsHeldAgainstTheAirWhereItIsKnownOfBothRuns) {
  const auto thinner = reference_drift(reference_runs({0, -0.03}, {1.2, 1.2 * 0.97}));
  ASSERT_TRUE(thinner && thinner->same_air);
  EXPECT_FALSE(thinner->drifted()) << thinner->to_words();
  EXPECT_FALSE(reference_drift(reference_runs({0, -0.03}, {1.2, std::nan("")}))->same_air);
  EXPECT_TRUE(reference_drift(reference_runs({0, -0.03}))->drifted());
}

TEST(ReferenceDrift, IsUnknownWithoutTwoGoodRuns) {
  EXPECT_FALSE(reference_drift(reference_runs({0})));
  EXPECT_FALSE(reference_drift({}));
  auto steps = reference_runs({0, 0.02});
  for (StepMean& step : steps) {
    if (step.repetition == -2) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::zero_drifted);
  }
  EXPECT_FALSE(reference_drift(steps));
}

}  // namespace kphi::results::reference_drift_test
