// Time constant and delay of the motor and of the thrust, from the steps that every run holds anyway.
#pragma once

#include <optional>
#include <vector>

#include "fit/statistical_test.hpp"
#include "results/records.hpp"

namespace kphi::fit {

/// One change from a commanded speed to the next: ω(t) = ω1 + (ω0 − ω1) e^{−(t − delay)/τ}, and the thrust that follows
/// k ω(t)² with a lag of its own.
struct StepResponse {
  int step = 0;  ///< 0-based: the step that was entered
  double from_rad_s = 0, to_rad_s = 0;
  Estimate motor_time_constant_s;
  Estimate motor_delay_s;  ///< from the command's time stamp
  Estimate thrust_lag_s;   ///< first-order lag of the thrust behind k ω²
};

struct Dynamics {
  std::vector<StepResponse> steps;
  Estimate motor_time_constant_s;  ///< weighted means over the steps, enlarged where they scatter more than they claim
  Estimate motor_delay_s;
  Estimate thrust_lag_s;
};

/// Nothing when no step of the run can tell. Steps smaller than `least_change_rad_s` are skipped.
[[nodiscard]] std::optional<Dynamics> identify_dynamics(const results::RunRecording& run,
                                                        double least_change_rad_s = 20);

}  // namespace kphi::fit
