#include "fit/plan/stand_noise.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/fit/plan/plan_study.hpp"

namespace kphi::fit {
namespace stand_noise_test {

using ::testing::HasSubstr;

TEST(StandNoise, OfPilotsIsThatOfTheirStand) {
  const SimulatedStand& stand = stands()[2];  // σ = 0.003 N with a memory of 1 s, 0.006 N of walk in a minute
  const StandNoise noise = piloted(stand, 20, 1);
  const double a_second = std::sqrt(2 * (1 - (1 - std::exp(-1.0))));  // of the mean over 1 s
  EXPECT_NEAR(noise.slow_n, 0.003 * a_second, 0.15 * 0.003);
  EXPECT_NEAR(noise.slow_memory_s, 1, 0.4);
  EXPECT_NEAR(noise.zero_walk_n, 0.006, 0.0012);
  EXPECT_LT(noise.runs, 0.001);
  EXPECT_NEAR(noise.K_T, 1.55e-6, 1e-9);
  EXPECT_NEAR(noise.k_at(135), true_k(stand, 135), 2e-9);
  EXPECT_NEAR(noise.settle_s, 1, 1e-9);
  EXPECT_EQ(noise.model, 0);
}

TEST(StandNoise, KnowsTheMountingOnlyFromRepetitionsThatWereMountedAnew) {
  const StandNoise remounted = piloted(stands()[1], 10, 1);
  ASSERT_TRUE(remounted.mounting);
  EXPECT_NEAR(*remounted.mounting, 0.003, 0.0006);
  IdentificationOptions once;
  once.mounted_once = true;
  const Fitted fitted = analysed(identify(simulate(planned_campaign(), stands()[0], 1), once));
  const std::vector<PilotCampaign> pilot{{fitted, 1, true}};
  EXPECT_FALSE(noise_of(pilot).mounting) << "what was assumed is not known";
}

TEST(StandNoise, AveragesWhatForgetsAndKeepsWhatDoesNot) {
  StandNoise noise;
  noise.noise_n = 0.01;
  EXPECT_NEAR(noise.step_n(1, 1), 0.01, 1e-12);
  EXPECT_NEAR(noise.step_n(1, 4), 0.005, 1e-12);
  noise.noise_n = 0;
  noise.slow_n = 0.01;
  EXPECT_NEAR(noise.step_n(1, 4), 0.01, 1e-5) << "endless memory";
  noise.slow_memory_s = 0.001;
  EXPECT_NEAR(noise.step_n(1, 4), 0.005, 1e-4);
  noise.slow_share = 0.1;
  EXPECT_NEAR(noise.step_n(2, 1), std::hypot(0.01, 0.2), 1e-3);
  EXPECT_NEAR(noise.zero_u_n(1), 0.01 / std::sqrt(2), 1e-4) << "two zeros";
}

TEST(StandNoise, IsStatedByName) {
  StandNoise noise;
  state(noise, "runs=0.002");
  state(noise, "mounting=0.003");
  state(noise, "slope-per-deg=-0.0029");
  EXPECT_EQ(noise.runs, 0.002);
  EXPECT_EQ(noise.mounting, 0.003);
  EXPECT_EQ(noise.slope_per_deg, -0.0029);
  const auto known = known_noise(noise);
  EXPECT_EQ(known.size(), 18u);
  for (const auto& [name, value] : known) EXPECT_NO_THROW(state(noise, fmt::format("{}={}", name, value))) << name;
  for (const char* wrong : {"runs", "runs=", "runs=-1", "runs=x", "run=1", "", "=1", "noise-n=nan", "noise-n=inf"}) {
    try {
      state(noise, wrong);
      ADD_FAILURE() << wrong;
    } catch (const ConfigurationError& error) {
      EXPECT_THAT(error.what(), HasSubstr("NAME one of noise-n")) << wrong;
    }
  }
}

TEST(StandNoise, NeedsARepetition) {
  const Fitted once = analysed(identify(simulate(planned_campaign({0, 90, 180, 270}, 1), stands()[0], 1)));
  const PilotCampaign pilot{once, 2, false};
  EXPECT_THROW((void)noise_of(std::span(&pilot, 1)), ConfigurationError);
}

TEST(StandNoise, DoesNotMixPilotsThatWereMountedDifferently) {
  const Fitted one = analysed(identify(simulate(planned_campaign(), stands()[0], 1)));
  const std::vector<PilotCampaign> pilots{{one, 2, true}, {one, 2, false}};
  EXPECT_THROW((void)noise_of(pilots), ConfigurationError);
}

}  // namespace stand_noise_test
}  // namespace kphi::fit
