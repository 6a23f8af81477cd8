#include "results/reduction/step_averages.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "results/reduction/repetitions.hpp"
#include "results/steps_csv.hpp"
#include "test/results/reduction/repeated_runs.hpp"
#include "test/results/synthetic_run.hpp"

namespace kphi::results::step_averages_test {
using namespace testing;

using test::k_of;
using test::runs;

TEST(MeansOf, RepetitionsAverageSoThatThrustOverSpeedSquaredStaysTheCoefficient) {
  std::vector<StepMean> steps;
  for (int rep = 1; rep <= 3; ++rep) {
    StepMean s;
    s.propeller = "5x3";
    s.occlusion_deg = 90;
    s.repetition = rep;
    s.speed_rad_s = 900 + 50 * rep;
    s.thrust_n = 1.3e-6 * s.speed_rad_s * s.speed_rad_s;
    s.thrust_samples = 100;
    s.quality_flags = static_cast<std::uint32_t>(rep == 2 ? QualityFlag::coil_hot : QualityFlag::none);
    s.supply_current_a = rep == 1 ? std::nan("") : 2.0 * rep;
    s.thrust_u_n = 0.003;
    s.thrust_freedom = 20;
    s.speed_glitches = 1;
    steps.push_back(s);
  }
  const auto mean = means_of(steps);
  ASSERT_EQ(mean.size(), 1u);
  EXPECT_EQ(mean[0].repetition, 0);
  EXPECT_NEAR(k_of(mean[0]), 1.3e-6, 1e-18);
  EXPECT_EQ(mean[0].thrust_samples, 300u);
  EXPECT_EQ(mean[0].supply_current_a, 5.0);
  EXPECT_NEAR(mean[0].thrust_u_n, 0.003 / std::sqrt(3.0), 1e-12);
  EXPECT_NEAR(mean[0].thrust_freedom, 60, 1e-9);
  EXPECT_EQ(mean[0].speed_glitches, 3u);
  EXPECT_EQ(quality_flag_names(mean[0].quality_flags), "coil_hot");
  steps[0].thrust_u_n = 0.009;
  EXPECT_NEAR(means_of(steps)[0].thrust_freedom, 20 * 11 * 11 / 83.0, 1e-9) << "Welch-Satterthwaite";
}

TEST(MeansOf, AreGroupedByPropellerOcclusionAndStep) {
  std::vector<StepMean> steps;
  for (const char* propeller : {"b", "a"}) {
    for (const double phi : {90.0, 0.0}) {
      for (int rep = 1; rep <= 2; ++rep) {
        for (int step = 0; step < 3; ++step) {
          StepMean s;
          s.propeller = propeller;
          s.occlusion_deg = phi;
          s.repetition = rep;
          s.step = step;
          s.thrust_n = rep;
          steps.push_back(s);
        }
      }
    }
  }
  const auto means = means_of(steps);
  ASSERT_EQ(means.size(), 12u);
  EXPECT_EQ(means[0].propeller, "b");
  EXPECT_EQ(means[3].occlusion_deg, 0);
  for (const StepMean& mean : means) EXPECT_EQ(mean.thrust_n, 1.5);
}

TEST(MeansOf, KeepWhatIsFarFromTheOthers) {
  const auto steps = runs({0, 0.03, 0.0005});
  ASSERT_TRUE(judge_repetitions(steps).at(0).repetitions[1].outlying);
  const StepMean mean = means_of(steps).at(7);
  EXPECT_NEAR(mean.thrust_n, (steps[7].thrust_n + steps[27].thrust_n + steps[47].thrust_n) / 3, 1e-12);
  EXPECT_EQ(mean.repetitions_averaged, 3);
  EXPECT_EQ(mean.repetitions_left_out, 0);
}

TEST(MeansOf, LeaveOutAFlaggedStepWhenAnotherRepetitionIsGoodAndSaySo) {
  auto steps = runs({0, 0.001});
  for (auto& step : steps)
    if (step.repetition == 2)
      step.quality_flags =
          static_cast<std::uint32_t>(step.step < 10 ? QualityFlag::zero_drifted : QualityFlag::coil_hot);
  const auto means = means_of(steps);
  EXPECT_EQ(means.at(5).thrust_n, steps.at(5).thrust_n);
  EXPECT_EQ(means.at(5).quality_flags, 0u);
  EXPECT_EQ(means.at(5).repetitions_averaged, 1);
  EXPECT_EQ(means.at(5).repetitions_left_out, 1);
  EXPECT_NEAR(means.at(15).thrust_n, 0.5 * (steps.at(15).thrust_n + steps.at(35).thrust_n), 1e-12) << "hot is harmless";
  const auto again = parse_steps(format_steps(means), "means.csv");
  EXPECT_EQ(again.at(3).repetitions_left_out, 1);
  EXPECT_EQ(again.at(15).repetitions_left_out, 0);
  for (auto& step : steps) step.quality_flags = static_cast<std::uint32_t>(QualityFlag::zero_drifted);
  EXPECT_NEAR(means_of(steps).at(5).thrust_n, 0.5 * (steps.at(5).thrust_n + steps.at(25).thrust_n), 1e-12)
      << "all are flagged: better that than nothing";
}

}  // namespace kphi::results::step_averages_test
