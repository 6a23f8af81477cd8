#include "results/reduction/lag.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace kphi::results {
namespace {

struct Truth {
  double delay_s = 0;
  double smoothing_s = 0;
  double motor_s = 0.1;
  double noise_n = 0.004;  ///< of a bin
  int steps = 20;
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
    for (double t = -0.8 + phase(random); t < 2; t += 0.02) {
      if (t > 0 && transition.squared.back().time_s < 0) transition.squared.push_back({0, before * before});
      transition.squared.push_back({t, squared(t)});
    }
    double felt = before * before;
    for (int bin = 0; bin < 20; ++bin) transition.before.push_back(1.5e-6 * felt + noise(random));
    for (int bin = 0; bin < 200; ++bin) {
      double sum = 0;
      for (int k = 0; k < 100; ++k) {
        const double now = squared(1e-4 * (100 * bin + k + 0.5) - truth.delay_s);
        felt = truth.smoothing_s > 0 ? felt + (now - felt) * 1e-4 / truth.smoothing_s : now;
        sum += felt;
      }
      transition.thrust.push_back(1.5e-6 * sum / 100 + noise(random));
    }
    all.push_back(transition);
  }
  return all;
}

TEST(Lag, IsRecoveredWithinFiveMilliseconds) {
  for (const double motor : {0.02, 0.1, 0.4}) {
    for (const double delay : {0.0, 0.02, 0.1, 0.3}) {
      const Lag lag = estimate_lag(transitions({delay, 0, motor}));
      EXPECT_TRUE(lag.known());
      EXPECT_NEAR(lag.seconds, delay, 0.005) << motor;
      EXPECT_LT(lag.u, 0.004);
    }
  }
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
  int inside = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const Lag lag = estimate_lag(transitions({0.1, 0, 0.1, 0.02}, seed));
    inside += std::abs(lag.seconds - 0.1) < 2.1 * lag.u + 0.001;  // 1 ms: speeds are 20 ms apart
  }
  EXPECT_GE(inside, 85);
}

TEST(Lag, IsUnknownFromTooFewStepsFromNoiseAndOutsideTheSearch) {
  EXPECT_FALSE(estimate_lag({}).known());
  EXPECT_FALSE(estimate_lag(transitions({0.1, 0, 0.1, 0.004, 2})).known());
  EXPECT_FALSE(estimate_lag(transitions({0.1, 0, 0.1, 5.0})).known());
  EXPECT_FALSE(estimate_lag(transitions({0.9, 0, 0.1})).known());
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

}  // namespace
}  // namespace kphi::results
