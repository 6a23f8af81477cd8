#include "results/reduction/bin_statistics.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace kphi::results::bin_statistics_test {

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

constexpr double kBin = 0.01;

/// 2 s in bins: `level`, plus `amplitude` that dies with `tau_s`, plus noise of 0.3 % of the level.
std::vector<double> step(double level, double amplitude, double tau_s, unsigned seed = 1, double slope_per_s = 0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 0.003 * level);
  std::vector<double> thrust;
  for (int i = 0; i < 200; ++i) {
    const double t = kBin * (i + 0.5);
    thrust.push_back(level + amplitude * std::exp(-t / tau_s) + slope_per_s * t + noise(random));
  }
  return thrust;
}

/// What the bins of a step hold besides its thrust: white noise, one with a memory, and what is left of blades passing.
struct Noise {
  double white_n, correlated_n, correlation_s, periodic_n;
};
constexpr Noise kNoises[] = {
    {0.003, 0, 1, 0}, {0.0015, 0.01, 0.003, 0}, {0.0015, 0.01, 0.01, 0}, {0.003, 0.004, 0.03, 0}, {0.003, 0, 1, 0.01}};

/// 2 s in bins from the command on.
std::vector<double> noisy_step(std::mt19937_64& random, const Noise& noise, double level, double share_per_s,
                               double transient = 0, double tau_s = 1) {
  std::normal_distribution<double> unit(0, 1);
  std::uniform_real_distribution<double> any(0, 1);
  const double kept = std::exp(-0.1 * kBin / noise.correlation_s);
  const double cycles_per_bin = 0.02 + 0.48 * any(random), phase = any(random);
  double wander = noise.correlated_n * unit(random);
  std::vector<double> thrust;
  for (int i = 0; i < 200; ++i) {
    double mean = 0;
    for (int k = 0; k < 10; ++k) {
      wander = kept * wander + noise.correlated_n * std::sqrt(1 - kept * kept) * unit(random);
      mean += 0.1 * wander;
    }
    const double t = kBin * (i + 0.5);
    thrust.push_back(level * (1 + share_per_s * t) + transient * std::exp(-t / tau_s) + mean +
                     noise.periodic_n * std::sin(2 * M_PI * (cycles_per_bin * i + phase)) +
                     noise.white_n * unit(random));
  }
  return thrust;
}

struct Verdicts {
  double unsettled = 0, drifted = 0;  ///< shares of the steps
};

template <class Step>
Verdicts verdicts(int steps, Step&& step) {
  std::mt19937_64 random(11);
  int unsettled = 0, drifted = 0;
  for (int i = 0; i < steps; ++i) {
    const std::vector<double> thrust = step(random);
    unsettled += static_cast<int>(!settle(thrust, 100, 100, kBin).settled);
    drifted += static_cast<int>(drifts(std::span(thrust).subspan(100)));
  }
  return {static_cast<double>(unsettled) / steps, static_cast<double>(drifted) / steps};
}

TEST(Verdict, OfAStepAtRestIsFalseInFewerThanOneOfAThousand) {
  Verdicts mean;
  for (const Noise& noise : kNoises) {
    const Verdicts found = verdicts(4000, [&](auto& random) { return noisy_step(random, noise, 0.05, 0); });
    mean.unsettled += found.unsettled / std::size(kNoises);
    mean.drifted += found.drifted / std::size(kNoises);
    EXPECT_LT(found.unsettled, 0.002) << noise.correlation_s << " s " << noise.periodic_n << " N";
    EXPECT_LT(found.drifted, 0.001) << noise.correlation_s << " s " << noise.periodic_n << " N";
  }
  EXPECT_LT(mean.unsettled, 0.001);
  EXPECT_LT(mean.drifted, 0.0005);
}

TEST(Verdict, MissesHardlyAStepThatDriftsByTwoPercentPerSecond) {
  for (const Noise& noise : kNoises) {
    const Verdicts found = verdicts(300, [&](auto& random) { return noisy_step(random, noise, 6, -0.02); });
    EXPECT_GT(found.drifted, 0.9) << noise.correlation_s << " s " << noise.periodic_n << " N";
    EXPECT_GT(found.unsettled, 0.8) << noise.correlation_s << " s " << noise.periodic_n << " N";
  }
}

TEST(Verdict, MissesHardlyATransientThatOutlastsTheStep) {
  for (const Noise& noise : kNoises) {
    const Verdicts found = verdicts(300, [&](auto& random) { return noisy_step(random, noise, 6, 0, -1.2, 0.8); });
    EXPECT_GT(found.unsettled, 0.8) << noise.correlation_s << " s " << noise.periodic_n << " N: 2 % of the mean";
  }
}

TEST(Settling, TakesAllThatTheDiscardLeavesOfAStepAtRest) {
  int whole = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const Settling found = settle(step(3, 0, 1, seed), 100, 100, kBin);
    EXPECT_TRUE(found.settled) << seed;
    whole += found.begin == 100;
  }
  EXPECT_GE(whole, 90) << "one in twenty looks like a slope by chance";
}

TEST(Settling, WaitsUntilATransientHasDied) {
  const Settling found = settle(step(3, -3, 0.2), 100, 100, kBin);
  EXPECT_TRUE(found.settled);
  EXPECT_GT(found.begin, 100u);
  EXPECT_LT(found.begin, 150u);
}

TEST(Settling, NeverCallsAStepSettledThatStillMovesAtItsEnd) {
  const Settling found = settle(step(3, -3, 1.5), 100, 100, kBin);
  EXPECT_FALSE(found.settled);
  EXPECT_EQ(found.begin, 150u) << "the last half second";
}

TEST(Settling, LetsPassWhatCannotSpoilTheCoefficient) {
  std::vector<double> thrust(200, 3.0);
  for (std::size_t i = 0; i < thrust.size(); ++i) thrust[i] += 1e-6 * (i % 3 == 0) + 1e-5 * static_cast<double>(i);
  EXPECT_TRUE(settle(thrust, 100, 100, kBin).settled) << "0.03 % from end to end, though certain";
  for (std::size_t i = 0; i < thrust.size(); ++i) thrust[i] += 9e-5 * static_cast<double>(i);
  EXPECT_FALSE(settle(thrust, 100, 100, kBin).settled) << "0.15 % in the last half second";
}

TEST(Settling, IsNotToldByASpeedThatCameTooLate) {
  EXPECT_FALSE(settle(step(3, 0, 1), 170, 100, kBin).settled);
  EXPECT_EQ(settle(step(3, 0, 1), 170, 100, kBin).begin, 170u);
  EXPECT_FALSE(settle({}, 0, 0, kBin).settled);
}

TEST(Drifts, WhatMovesByMoreThanHalfAPercentInTheSecondHalf) {
  const auto ramp = [](double share_per_half) {
    std::vector<double> thrust;
    for (int i = 0; i < 200; ++i) thrust.push_back(3 * (1 + share_per_half * (i - 100) / 100.0));
    return thrust;
  };
  EXPECT_FALSE(drifts(ramp(0.004)));
  EXPECT_TRUE(drifts(ramp(0.006)));
  EXPECT_TRUE(drifts(ramp(-0.006)));
}

TEST(Settling, PassesOverBinsThatHoldNothing) {
  std::vector<double> thrust = step(3, 0, 1);
  for (std::size_t i = 120; i < 140; ++i) thrust[i] = std::nan("");
  EXPECT_TRUE(settle(thrust, 100, 100, kBin).settled);
}

TEST(Drift, IsAChangeThatGoesOn) {
  EXPECT_TRUE(drifts(step(3, 0, 1, 1, 0.06)));
  EXPECT_TRUE(drifts(step(3, 0, 1, 1, -0.06)));
  std::vector<double> jumps = step(3, 0, 1, 1, -0.06);
  for (std::size_t i = 0; i < 70; ++i) jumps[i] += 1;
  EXPECT_TRUE(drifts(jumps)) << "all the more";
}

TEST(Drift, IsNoNoiseNoSmallChangeAndNoTransient) {
  for (unsigned seed = 1; seed <= 100; ++seed) EXPECT_FALSE(drifts(step(3, 0, 1, seed))) << seed;
  EXPECT_FALSE(drifts(step(3, 0, 1, 1, 0.006))) << "0.2 % in the second half";
  EXPECT_FALSE(drifts(step(3, -1, 0.15))) << "dies";
  EXPECT_FALSE(drifts(std::vector<double>(4, 1.0)));
  std::vector<double> tent;
  for (int i = 0; i < 200; ++i) tent.push_back(3 - 0.001 * std::abs(i - 100));
  EXPECT_FALSE(drifts(tent)) << "turns round";
}

}  // namespace kphi::results::bin_statistics_test
