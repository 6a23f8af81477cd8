// Time constant and delay of the motor and lag of the thrust, from the changes of speed between the steps of a run.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

#include "fit/numerics/hypothesis_test.hpp"
#include "results/records.hpp"

namespace kphi::fit {

struct Dynamics {
  std::size_t steps = 0;  ///< changes of speed behind the figures of the motor
  /// ω(t) = ω1 + (ω0 − ω1) e^{−(t − delay)/τ} fitted to the readings of all steps together: one step has too few.
  /// science.md, eq. 33.
  Estimate motor_time_constant_s;
  Estimate motor_delay_s;  ///< from the command's time stamp
  Estimate thrust_lag_s;   ///< mean delay of the thrust behind ω² (results/reduction/lag.hpp); NaN: unknown
};

/// Uses the steps that change the speed before them by 1 % or more, without a ramp; nullopt for fewer than 3.
[[nodiscard]] std::optional<Dynamics> identify_dynamics(std::span<const results::RunRecording> runs);

}  // namespace kphi::fit
