// How much later the thrust shows than the speed: box, filter, wire, air and stand together.
//
// Model: thrust(t) = a + b·(h ∗ ω²)(t), where h delays by L and smooths with the time constant τ, each step with its
// own a and b, and L and τ those of the run: least squares over all steps. What is told is the mean delay L + τ: a
// thrust that follows a ramp of ω² is late by just that.
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
  std::vector<double> before;         ///< means of bins up to the command, kThrustHistory long: the level it leaves
  std::vector<double> thrust;         ///< of bins from the command on, the same unit; NaN: nothing measured
  std::vector<SquaredSpeed> squared;  ///< ascending; from kSpeedHistory before the command on
};
inline constexpr double kThrustHistory = 0.2;  ///< s
inline constexpr double kSpeedHistory = 0.8;   ///< s

struct Lag {
  double seconds = 0;
  double u = std::numeric_limits<double>::quiet_NaN();  ///< standard, from the scatter between the steps
  double smoothing = 0;                                 ///< the part of it that is a time constant, s
  /// Steps enough to tell, within the range that was searched, and to 20 ms.
  [[nodiscard]] bool known() const { return u <= 0.02; }
};

[[nodiscard]] Lag estimate_lag(std::span<const Transition> transitions);

/// ω² delayed and smoothed as the thrust is, mean of each bin: what the thrust should be proportional to.
[[nodiscard]] std::vector<double> delayed(const Transition& transition, const Lag& lag);

}  // namespace kphi::results
