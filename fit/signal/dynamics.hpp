// Time constant and delay of the motor and lag of the thrust, from the steps that every run holds anyway.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/numerics/hypothesis_test.hpp"
#include "results/records.hpp"

namespace kphi::fit {

/// One change from a commanded speed to the next.
struct StepResponse {
  int step = 0;  ///< 0-based: the step that was entered
  double from_rad_s = 0, to_rad_s = 0;
  double from_n = 0, to_n = 0;
  /// By how much the thrust comes after k ω², s: ∫(k ω² − T) dt over the change of T. For a first-order lag that is its
  /// time constant, whatever course the speed takes; a pure delay of the cell counts in.
  double thrust_lag_s = 0;
};

struct Dynamics {
  std::vector<StepResponse> steps;
  /// ω(t) = ω1 + (ω0 − ω1) e^{−(t − delay)/τ} through the readings of all steps together: alone, each has too few.
  Estimate motor_time_constant_s;
  Estimate motor_delay_s;  ///< from the command's time stamp
  Estimate thrust_lag_s;   ///< mean over the steps, weighted by the change of thrust squared
};

/// Nothing when fewer than 3 steps can tell: those that change by `least_change` of the speed before, or more.
[[nodiscard]] std::optional<Dynamics> identify_dynamics(std::span<const results::RunRecording> runs,
                                                        double least_change = 0.01);

}  // namespace kphi::fit
