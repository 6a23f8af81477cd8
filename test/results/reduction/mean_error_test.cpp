#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "results/reduction/bin_statistics.hpp"

namespace kphi::results {
namespace mean_error_test {

/// First-order autoregressive noise of deviation 1 whose correlation falls to 1/e in `memory` values.
std::vector<double> noise(std::mt19937_64& random, std::size_t n, double memory) {
  std::normal_distribution<double> normal;
  const double kept = memory > 0 ? std::exp(-1 / memory) : 0;
  std::vector<double> values(n);
  double value = normal(random);
  for (double& v : values) {
    v = value;
    value = kept * value + std::sqrt(1 - kept * kept) * normal(random);
  }
  return values;
}

double coverage(std::size_t n, double memory) {
  std::mt19937_64 random(7);
  constexpr int kTrials = 1000;
  int inside = 0;
  for (int i = 0; i < kTrials; ++i) {
    const MeanError error = mean_error(noise(random, n, memory));
    inside += std::abs(error.mean) <= student_95(error.freedom) * error.u;
  }
  return static_cast<double>(inside) / kTrials;
}

TEST(MeanError, OfWhiteNoiseIsTheDeviationOverTheRootOfTheNumber) {
  std::mt19937_64 random(1);
  const MeanError error = mean_error(noise(random, 10'000, 0));
  EXPECT_NEAR(error.u, 0.01, 0.0005);
  EXPECT_NEAR(error.correlation, 1, 0.1);
}

TEST(MeanError, FindsTheIntegratedCorrelationTime) {
  std::mt19937_64 random(2);
  const double memory = 8;
  const double truth = 1 / std::tanh(0.5 / memory);  // 1 + 2 Σ exp(-i/memory)
  EXPECT_NEAR(mean_error(noise(random, 100'000, memory)).correlation, truth, 0.06 * truth);
}

TEST(MeanError, CoversTheTruthAsOftenAsItSays) {
  for (const double memory : {0.0, 0.5, 1.0, 2.0}) {
    EXPECT_GE(coverage(100, memory), 0.93) << memory;
    EXPECT_LE(coverage(100, memory), 0.97) << memory;
  }
}

TEST(MeanError, OfAPeriodicDisturbanceIsNoLargerThanThatOfWhiteNoise) {
  std::vector<double> values;
  for (int i = 0; i < 400; ++i) values.push_back(std::sin(2 * M_PI * i / 8.0));
  EXPECT_LT(mean_error(values).u, 1.05 * std::sqrt(0.5 / 400.0));
}

TEST(MeanError, CoversTheTruthInANoiseThatSwings) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> any(0, 1);
  constexpr int kTrials = 2000;
  for (const double amplitude : {0.4, 1.0, 3.0}) {
    int inside = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const double cycles = 0.05 + 0.45 * any(random), phase = any(random);
      std::vector<double> values = noise(random, 100, 0);
      for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] += amplitude * std::sin(2 * M_PI * (cycles * static_cast<double>(i) + phase));
      }
      const MeanError error = mean_error(values);
      inside += std::abs(error.mean) <= student_95(error.freedom) * error.u;
    }
    EXPECT_GE(inside, 0.93 * kTrials) << amplitude;
    EXPECT_LE(inside, 0.98 * kTrials) << amplitude;
  }
}

TEST(MeanError, SaysNothingOfTooFewValuesAndNothingElseOfEqualOnes) {
  EXPECT_TRUE(std::isnan(mean_error({}).mean));
  EXPECT_TRUE(std::isnan(mean_error(std::vector<double>(kLeastValues - 1, 2.0)).u));
  const MeanError equal = mean_error(std::vector<double>(50, 2.0));
  EXPECT_EQ(equal.mean, 2.0);
  EXPECT_EQ(equal.u, 0.0);
}

TEST(MeanError, TakesATrendAway) {
  const auto rest = without_trend(std::vector<double>{1, 3, 5, 7});
  for (const double value : rest) EXPECT_NEAR(value, 0, 1e-12);
  EXPECT_TRUE(without_trend({}).empty());
}

TEST(MeanError, KnowsStudentsT) {
  EXPECT_NEAR(student_95(2), 4.3027, 1e-4);
  EXPECT_NEAR(student_95(1e9), 1.96, 1e-3);
  EXPECT_TRUE(std::isnan(student_95(0)));
}

TEST(MeanError, JoinsDegreesOfFreedom) {
  EXPECT_NEAR(joint_freedom(1, 10, 1, 10), 20, 1e-9);
  EXPECT_NEAR(joint_freedom(1, 10, 0, 3), 10, 1e-9);
  EXPECT_NEAR(joint_freedom(1, 10, 2, 5), 25 / (1 / 10.0 + 16 / 5.0), 1e-9);
}

}  // namespace mean_error_test
}  // namespace kphi::results
