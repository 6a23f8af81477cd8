#include "profiles/run_certainty.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace kphi::profiles {
namespace run_certainty_test {

constexpr double kShare = 0.002, kK = 1.5e-6, kLeast = 0.7;

std::vector<PlannedStep> steps(int n, StepOrderKind kind = StepOrderKind::up) {
  const StepProfile profile{n, Seconds(2), from_rpm(3000), from_rpm(19100)};
  return steps_in_order(profile.levels(), kind, 7);
}

double thrust_n(const PlannedStep& step) { return kK * step.speed.value() * step.speed.value(); }

/// A run in which noise makes a step uncertain by u_1s / √s.
struct HeldRun {
  std::vector<PlannedStep> held;
  double k_share = 0;  ///< half of the 95 % interval of k by noise alone
  double longest_s = 0;
};

HeldRun run(const std::vector<PlannedStep>& planned, double u_1s, double most_s = 1e3) {
  RunCertainty certainty({kShare, Seconds(kLeast)}, planned);
  HeldRun result;
  double noise = 0, squares = 0;
  for (const PlannedStep& step : planned) {
    if (!certainty.needs(step)) {
      certainty.left_out(step);
      continue;
    }
    const double enough_n = certainty.enough_n(step, thrust_n(step));
    const double held_s = std::min(most_s, std::max(kLeast, std::pow(u_1s / enough_n, 2)));
    const double u_n = u_1s / std::sqrt(held_s), x = step.speed.value() * step.speed.value();
    certainty.held(step, thrust_n(step), u_n, held_s);
    noise += x * x * u_n * u_n;
    squares += x * x;
    result.longest_s = std::max(result.longest_s, held_s);
    result.held.push_back(step);
  }
  result.k_share = 2 * std::sqrt(noise) / squares / kK;
  return result;
}

TEST(RunCertainty, OfAQuietStandLeavesOutEverySecondLevel) {
  const HeldRun quiet = run(steps(40), 0.0005);
  EXPECT_EQ(quiet.held.size(), 21u) << "20 of them, and the fastest";
  EXPECT_EQ(quiet.held.front().number, 0);
  EXPECT_EQ(quiet.held.back().number, 39);
  EXPECT_EQ(quiet.longest_s, kLeast);
  EXPECT_LT(quiet.k_share, kShare / 2);
}

TEST(RunCertainty, NeverLeavesOutTwoNeighbours) {
  for (const double u_1s : {1e-5, 1e-3, 1e-2, 0.05, 1.0}) {
    const HeldRun one = run(steps(40), u_1s);
    for (std::size_t i = 1; i < one.held.size(); ++i) EXPECT_LE(one.held[i].number - one.held[i - 1].number, 2) << u_1s;
  }
}

// Loud enough that the shortest steps do not do.
TEST(RunCertainty, SpendsNoMoreThanHalfOfTheWishedIntervalOnNoise) {
  for (const double u_1s : {0.002, 0.01, 0.02, 0.05}) {
    const HeldRun one = run(steps(40), u_1s);
    EXPECT_LE(one.k_share, kShare / 2 * (1 + 1e-9)) << u_1s;
  }
  EXPECT_NEAR(run(steps(40), 0.05).k_share, kShare / 2, 1e-6) << "and no less than it must";
}

TEST(RunCertainty, NeedsEveryStepOfALoudStand) { EXPECT_EQ(run(steps(40), 0.05, 0.8).held.size(), 40u); }

TEST(RunCertainty, NeedsEveryStepOfAShortRun) {
  EXPECT_EQ(run(steps(19), 0.0005).held.size(), 19u);
  EXPECT_EQ(run(steps(20), 0.0005).held.size(), 11u);
}

TEST(RunCertainty, LeavesOutTheSameLevelsInAnyOrder) {
  for (const StepOrderKind kind : {StepOrderKind::down, StepOrderKind::shuffled}) {
    const HeldRun one = run(steps(40, kind), 0.0005);
    for (const PlannedStep& step : one.held)
      EXPECT_TRUE(step.number % 2 == 0 || step.number == 39 || &step == &one.held.front()) << step.number;
  }
  // Both ways hold the same speeds, as the hysteresis needs them.
  const HeldRun back = run(steps(20, StepOrderKind::up_and_down), 0.0005);
  for (const PlannedStep& step : back.held) EXPECT_TRUE(step.number % 2 == 0 || step.number == 19) << step.number;
}

TEST(RunCertainty, CountsAStepThatNeverSettledAsNotHeld) {
  const std::vector<PlannedStep> planned = steps(40);
  RunCertainty settled({kShare, Seconds(kLeast)}, planned), unsettled = settled;
  settled.held(planned[0], thrust_n(planned[0]), 0.001, kLeast);
  unsettled.held(planned[0], thrust_n(planned[0]), std::numeric_limits<double>::quiet_NaN(), 4);
  EXPECT_FALSE(settled.needs(planned[1]));
  EXPECT_TRUE(unsettled.needs(planned[1])) << "nothing is known of the noise";
  EXPECT_LT(unsettled.enough_n(planned[2], thrust_n(planned[2])), settled.enough_n(planned[2], thrust_n(planned[2])));
}

// The shortest steps to come will be noisier than a long one was.
TEST(RunCertainty, ExpectsOfShortStepsTheNoiseOfShortSteps) {
  const std::vector<PlannedStep> planned = steps(40);
  RunCertainty brief({kShare, Seconds(kLeast)}, planned), drawn_out = brief;
  brief.held(planned[0], thrust_n(planned[0]), 0.004, kLeast);
  drawn_out.held(planned[0], thrust_n(planned[0]), 0.004, 100 * kLeast);
  EXPECT_FALSE(brief.needs(planned[1]));
  EXPECT_TRUE(drawn_out.needs(planned[1]));
}

}  // namespace run_certainty_test
}  // namespace kphi::profiles
