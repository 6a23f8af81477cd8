// From a raw run to its step means: a pure function of the run file, so that live and replay give the same bytes.
#pragma once

#include <vector>

#include "results/records.hpp"
#include "results/step_mean.hpp"

namespace kphi::daq {

/// What the zeros of a run say of its thrust, N.
struct ZeroCheck {
  double moved_n = 0;      ///< from before to after; NaN with one of them only, or when the box started anew between
  double tolerated_n = 0;  ///< of moved_n
  double deviation_n = 0;  ///< of the samples, the larger one
  bool only_one = false;   ///< in a run that was finished: nobody knows how far it moved
  [[nodiscard]] bool drifted() const;
  [[nodiscard]] bool noisy() const;
};

struct Reduced {
  std::vector<results::StepMean> steps;
  ZeroCheck zero;
};

/// One mean per step that was held to its end, in the order of the commands.
///
/// Window of a step: from its command plus the minimum discard, and from the first speed reading within 1 % (at least
/// 2 rad/s) of the command, to the next command. Load cell and motor are averaged over the same window of bench time;
/// load-cell samples are placed by ClockMap.
/// Thrust: sign · (mean counts - zero) / counts per newton. Torque: about the direction of the thrust, likewise.
/// Zero: mean of zero_before and of zero_after (without its beginning, and only once the motor stands), linear in time
/// between the two; with one of them only, that one. A zero holds for one power-up of the box: when the box started
/// anew in the run, each step takes that of its own power-up if there is one, and all after the first are in doubt.
/// Standard deviations are those of the samples (n - 1). Speed is unsigned: positive in the direction of the spin.
/// Zeros that drifted or scatter (zero_limits.hpp) put all steps of the run in doubt.
/// Where the bench file of the run knows the gain of the module's clock, the mean speed and its deviation are true
/// ones: reported speed times gain. Doubts judge the reported speed, which is what the module holds to the command. A
/// motor channel without a reading in the window gives NaN.
///
/// An aborted run gives the steps before the one that was cut short. Throws RecordError when a run with steps holds no
/// load-cell samples in any zero window, or its scale cannot be used.
[[nodiscard]] std::vector<results::StepMean> reduce(const results::RunRecording& run);

/// The same, with what was found about the zeros.
[[nodiscard]] Reduced reduce_with_zeros(const results::RunRecording& run);

}  // namespace kphi::daq
