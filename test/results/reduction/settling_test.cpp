#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "results/reduction/bin_statistics.hpp"

namespace kphi::results {
namespace settling_test {

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

}  // namespace settling_test
}  // namespace kphi::results
