// Lag of the thrust behind the speed: box, filter, network, air and stand together.
//
// Model (science.md, eq. 10): thrust(t) = a + b·(h ∗ ω²)(t), where h delays by L and smooths with the time constant τ.
// Each step has its own a and b, the run has one L and one τ; least squares over all steps. The reported lag is the
// mean delay L + τ: a thrust that follows a ramp of ω² is late by exactly that. Between two readings ω² is taken as
// linear: over steps whose readings fall at any distance from the command that has no bias, whatever the response of
// the motor.
#pragma once

#include <limits>
#include <span>
#include <vector>

namespace kphi::results {

/// ω² at a time since the command, s.
struct SquaredSpeed {
  double time_s = 0;
  double value = 0;
};

/// One commanded change of speed.
struct Transition {
  double bin_s = 0;
  std::vector<double> before;         ///< thrust of the bins before the command, kThrustHistory long
  std::vector<double> thrust;         ///< of the bins from the command on, same unit; NaN: no samples
  std::vector<SquaredSpeed> squared;  ///< ascending; from kSpeedHistory before the command on
  bool ramped = false;                ///< the commanded speed was reached by a ramp before
};
inline constexpr double kThrustHistory = 0.2;  ///< s
inline constexpr double kSpeedHistory = 0.8;   ///< s

struct Lag {
  double seconds = 0;
  double u = std::numeric_limits<double>::quiet_NaN();  ///< standard: scatter between the steps, reading interval
  double smoothing = 0;                                 ///< part of the lag that is a time constant, s
  double freedom = 1;                                   ///< degrees of freedom of u
  /// Enough steps, within the search range, and certain to 20 ms.
  [[nodiscard]] bool known() const { return u <= 0.02; }
};

[[nodiscard]] Lag estimate_lag(std::span<const Transition> transitions);

/// ω² delayed and smoothed as the thrust is, mean of each bin: the quantity to which the thrust is proportional.
[[nodiscard]] std::vector<double> delayed(const Transition& transition, const Lag& lag);

}  // namespace kphi::results
