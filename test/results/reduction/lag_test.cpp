#include "results/reduction/lag.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace kphi::results::lag_test {

struct Truth {
  double delay_s = 0;
  double smoothing_s = 0;
  double motor_s = 0.1;
  double noise_n = 0.004;  ///< of a bin
  int steps = 20;
  double drift = 0;          ///< of the thrust over a step, relative
  double phase_s = nan("");  ///< of the readings, the same in all steps; NaN: another one in each step
};

/// A motor of first order on its way from 200 rad/s to `steps` times 50 more, read every 20 ms from some moment on; the
/// thrust of each millisecond is found by Euler's method, so that nothing here is the estimator's own arithmetic.
std::vector<Transition> transitions(const Truth& truth, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, truth.noise_n);
  std::uniform_real_distribution<double> phase(0, 0.02);
  std::vector<Transition> all;
  for (int i = 0; i < truth.steps; ++i) {
    const double before = 200 + 50.0 * i, after = before + 50;
    const auto squared = [&](double t) {
      const double speed = t < 0 ? before : after + (before - after) * std::exp(-t / truth.motor_s);
      return speed * speed;
    };
    Transition transition;
    transition.bin_s = 0.01;
    const double first = std::isnan(truth.phase_s) ? phase(random) : truth.phase_s;
    for (double t = -0.8 + first; t < 2; t += 0.02) transition.squared.push_back({t, squared(t)});
    double felt = before * before;
    for (int bin = 0; bin < 20; ++bin) transition.before.push_back(1.5e-6 * felt + noise(random));
    for (int bin = 0; bin < 200; ++bin) {
      double sum = 0;
      for (int k = 0; k < 100; ++k) {
        const double now = squared(1e-4 * (100 * bin + k + 0.5) - truth.delay_s);
        felt = truth.smoothing_s > 0 ? felt + (now - felt) * 1e-4 / truth.smoothing_s : now;
        sum += felt;
      }
      transition.thrust.push_back(1.5e-6 * sum / 100 * (1 + truth.drift * bin / 200) + noise(random));
    }
    all.push_back(transition);
  }
  return all;
}

TEST(Lag, IsRecoveredWithinFiveMilliseconds) {
  int smoothed = 0;
  for (const double motor : {0.02, 0.1, 0.4}) {
    for (const double delay : {0.0, 0.02, 0.1, 0.3}) {
      const Lag lag = estimate_lag(transitions({delay, 0, motor}));
      EXPECT_TRUE(lag.known());
      EXPECT_NEAR(lag.seconds, delay, 0.005) << motor;
      EXPECT_LT(lag.u, 0.004);
      smoothed += lag.smoothing > 0;
    }
  }
  EXPECT_LE(smoothed, 2) << "only where chance shows one";
  const std::vector<Transition> alike(5, transitions({0.1}).back());
  EXPECT_NEAR(estimate_lag(alike).freedom, 4, 1e-6) << "steps less one";
}

TEST(Lag, OfACellThatSmoothsIsItsMeanDelay) {
  for (const double motor : {0.02, 0.1}) {
    const Lag lag = estimate_lag(transitions({0.02, 0.1, motor}));
    EXPECT_NEAR(lag.seconds, 0.12, 0.005) << motor;
    EXPECT_NEAR(lag.smoothing, 0.1, 0.02) << motor;
  }
}

TEST(Lag, IsFoundFromStepsDownAsWell) {
  auto steps = transitions({0.1, 0, 0.1});
  for (auto& step : steps) {
    for (double& thrust : step.thrust) thrust = 3 - thrust;
    for (double& thrust : step.before) thrust = 3 - thrust;
    for (auto& speed : step.squared) speed.value = 2e6 - speed.value;
  }
  EXPECT_NEAR(estimate_lag(steps).seconds, 0.1, 0.005);
}

TEST(Lag, HasAnUncertaintyThatCoversTheTruth) {
  for (const auto& [delay, smoothing] : {std::pair{0.0, 0.0}, {0.1, 0.0}, {0.3, 0.0}, {0.0, 0.04}, {0.1, 0.2}}) {
    for (const double motor : {0.005, 0.02, 0.1}) {
      for (const double phase : {std::nan(""), 0.004, 0.016}) {
        int inside = 0;
        double u = 0;
        for (unsigned seed = 1; seed <= 20; ++seed) {
          const Lag lag = estimate_lag(transitions({delay, smoothing, motor, 0.01, 20, 0.002, phase}, seed));
          inside += std::abs(lag.seconds - delay - smoothing) < 2.1 * lag.u;
          u += lag.u / 20;
        }
        EXPECT_GE(inside, 17) << delay << " + " << smoothing << " s, motor " << motor << " s, phase " << phase << " s";
        EXPECT_LT(u, 0.008) << "half a reading interval, and what the steps scatter";
      }
    }
  }
}

/// A motor much faster than its readings: what is not read cannot be known, but it averages out over the steps.
TEST(Lag, IsNotBiasedByRareReadings) {
  double sum = 0;
  for (unsigned seed = 1; seed <= 50; ++seed) sum += estimate_lag(transitions({0.02, 0, 0.005}, seed)).seconds / 50;
  EXPECT_NEAR(sum, 0.02, 0.0005);
  EXPECT_LT(estimate_lag(transitions({0.02, 0, 0.005})).u, 0.003);
  EXPECT_GT(estimate_lag(transitions({0.02, 0, 0.005, 0.004, 20, 0, 0.004})).u, 0.004)
      << "readings at one distance from all commands";
}

TEST(Lag, IsUnknownFromTooFewStepsFromNoiseAndOutsideTheSearch) {
  EXPECT_FALSE(estimate_lag({}).known());
  EXPECT_FALSE(estimate_lag(transitions({0.1, 0, 0.1, 0.004, 2})).known());
  EXPECT_FALSE(estimate_lag(transitions({0.1, 0, 0.1, 5.0})).known());
  EXPECT_FALSE(estimate_lag(transitions({0.9, 0, 0.1})).known());
  EXPECT_FALSE(estimate_lag(transitions({-0.2, 0, 0.1})).known());
}

TEST(Lag, IsNotDisturbedByBinsThatHoldNothing) {
  auto steps = transitions({0.1, 0, 0.1});
  for (auto& step : steps) {
    for (std::size_t i : {0u, 5u, 6u, 30u}) step.thrust[i] = std::nan("");
  }
  EXPECT_NEAR(estimate_lag(steps).seconds, 0.1, 0.005);
}

TEST(Lag, ExplainsTheThrust) {
  const auto step = transitions({0.15, 0, 0.1, 0.0}).back();
  const auto squared = delayed(step, {0.15, 0.001, 0});
  ASSERT_EQ(squared.size(), step.thrust.size());
  for (std::size_t i = 0; i < squared.size(); ++i) EXPECT_NEAR(1.5e-6 * squared[i], step.thrust[i], 0.005) << i;
}

}  // namespace kphi::results::lag_test
