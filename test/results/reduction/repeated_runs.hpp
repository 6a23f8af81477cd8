// Runs of one occlusion that differ by a factor.
#pragma once

#include <random>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results::test {

inline constexpr double kThrustU = 0.002;

/// Runs of 20 steps; run i has the coefficient 1.5e-6 · (1 + off[i]).
inline std::vector<StepMean> runs(const std::vector<double>& off, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kThrustU);
  std::vector<StepMean> steps;
  for (std::size_t run = 0; run < off.size(); ++run) {
    for (int i = 0; i < 20; ++i) {
      StepMean s;
      s.propeller = "5x3";
      s.repetition = static_cast<int>(run) + 1;
      s.step = i;
      s.speed_rad_s = 200 + 90.0 * i;
      s.thrust_n = 1.5e-6 * (1 + off[run]) * s.speed_rad_s * s.speed_rad_s + noise(random);
      s.thrust_u_n = kThrustU;
      s.thrust_freedom = 30;
      s.zero_u_n = 0;
      steps.push_back(s);
    }
  }
  return steps;
}

}  // namespace kphi::results::test
