#include "results/reduction/run_zero.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <vector>

#include "base/random.hpp"

namespace kphi::results::run_zero_test {
using namespace testing;

/// Deviation of the weighted mean of a walk between two zeros about the line through them, and what SharedZero says.
struct OfAWalk {
  double found = 0, said = 0;
};

OfAWalk of_a_walk(const std::function<double(int step)>& weight, std::uint64_t seed) {
  constexpr int kSteps = 40, kPieces = 10, kDraws = 4000;
  Random random(seed);
  SharedZero zero;
  double weights = 0, squares = 0;
  for (int i = 0; i < kSteps; ++i) {
    zero.add(kNotMeasured, i, i + 1, weight(i));
    weights += weight(i);
  }
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> walk{0};
    for (int i = 0; i < kSteps * kPieces; ++i)
      walk.push_back(walk.back() + random.normal() / std::sqrt(kSteps * kPieces));
    double error = 0;
    for (int i = 0; i < kSteps; ++i) {
      const int middle = i * kPieces + kPieces / 2;
      error +=
          weight(i) / weights * (walk[static_cast<std::size_t>(middle)] - walk.back() * middle / (kSteps * kPieces));
    }
    squares += error * error / kDraws;
  }
  return {std::sqrt(squares), zero.u_n(1)};
}

TEST(SharedZero, OfAWalkIsAsUncertainAsTheWalkMakesIt) {
  const OfAWalk even = of_a_walk([](int) { return 1.0; }, 1), rising = of_a_walk([](int i) { return i * i; }, 2);
  EXPECT_NEAR(even.said, even.found, 0.05 * even.found);
  EXPECT_NEAR(rising.said, rising.found, 0.05 * rising.found);
  EXPECT_NEAR(even.said, 1 / std::sqrt(12), 0.01);
  EXPECT_NEAR(rising.said, 0.283, 0.002) << "of ω² over rising speeds: no less than of even weights";
  const OfAWalk last = of_a_walk([](int i) { return i == 39 ? 1.0 : 0; }, 3),
                middle = of_a_walk([](int i) { return i == 20 ? 1.0 : 0; }, 4);
  EXPECT_NEAR(last.said, 0.11, 0.01) << "beside the zero behind the run";
  EXPECT_NEAR(middle.said, 0.5, 0.01);
  EXPECT_NEAR(middle.said, middle.found, 0.05 * middle.found);
}

TEST(SharedZero, OfTwoNoisyZerosIsAsUncertainAsTheLineThroughThem) {
  constexpr double kBefore = 0.01, kAfter = 0.02;
  const std::vector<std::function<double(int step)>> weights{[](int) { return 1.0; }, [](int i) { return i * i; },
                                                             [](int i) { return i < 10   ? 0.2
                                                                                : i > 30 ? -0.04
                                                                                         : 0; }};
  for (const auto& weight : weights) {
    SharedZero zero;
    double before = 0, after = 0, sum = 0;
    for (int i = 0; i < 40; ++i) {
      const double share = (i + 2.5) / 45;  // the zeros are further away than the steps
      zero.add(std::hypot(kBefore * (1 - share), kAfter * share), i, i + 1, weight(i));
      before += weight(i) * (1 - share);
      after += weight(i) * share;
      sum += weight(i);
    }
    EXPECT_NEAR(zero.u_n(0), std::hypot(kBefore * before, kAfter * after) / sum, 1e-12);
  }
}

TEST(SharedZero, WithoutTimesIsThatOfARectangleAndAddsWhatWasMeasured) {
  SharedZero zero;
  for (int i = 0; i < 10; ++i) zero.add(0.003, 0, 0, 1);
  EXPECT_NEAR(zero.u_n(0), 0.003, 1e-12);
  EXPECT_NEAR(zero.u_n(0.012), std::hypot(0.003, 0.012 / std::sqrt(12)), 1e-12);
  EXPECT_EQ(SharedZero().u_n(1), 0);
}

/// A run whose zeros, each uncertain by `u_n`, are `moved_n` apart.
std::vector<StepMean> run_of(int repetition, double moved_n, double u_n) {
  std::vector<StepMean> steps;
  for (const double part : {0.0, 0.5, 1.0}) {
    StepMean step;
    step.repetition = repetition;
    step.zero_moved_n = moved_n;
    step.zero_u_n = u_n * std::hypot(1 - part, part);
    steps.push_back(step);
  }
  return steps;
}

TEST(ZeroMovement, OfZerosThatAreNoisyIsNoWander) {
  ZeroMovement noisy, wandering;
  for (const int repetition : {1, 2}) {
    for (const StepMean& step : run_of(repetition, 0.01 * std::sqrt(2), 0.01)) noisy.add(step);
    for (const StepMean& step : run_of(repetition, 0.05, 0.01)) wandering.add(step);
  }
  EXPECT_NEAR(noisy.usual_n(), 0.01 * std::sqrt(2), 1e-12);
  EXPECT_NEAR(noisy.of_run_n(run_of(1, 0, 0).front()), 0, 1e-9);
  EXPECT_NEAR(wandering.of_run_n(run_of(1, 0, 0).front()), std::sqrt(0.05 * 0.05 - 2e-4), 1e-9);
  EXPECT_NEAR(wandering.of_run_n(run_of(3, 0, 0).front()), std::sqrt(0.05 * 0.05 - 2e-4), 1e-9) << "unknown: as usual";
}

}  // namespace kphi::results::run_zero_test
