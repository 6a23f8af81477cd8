// From a raw run to its step means: a pure function of the run file, so that live and replay give the same bytes.
#pragma once

#include <vector>

#include "results/records.hpp"
#include "results/reduction/lag.hpp"
#include "results/reduction/zeros.hpp"
#include "results/step_mean.hpp"

namespace kphi::results {

struct Reduced {
  std::vector<StepMean> steps;
  ZeroCheck zero;
};

/// One mean per step that was held to its end, in the order of the commands.
///
/// Lag of the thrust behind the speed: from all steps of the run (lag.hpp). Thrust and torque are averaged over one
/// window, the readings of the module over the same window moved back by the lag. With an unknown lag both windows are
/// the same, and the steps are flagged.
/// Window of a step: to the next command, from the minimum discard and the lag after its own, not before the first
/// speed within 1 % (at least 2 rad/s) of the command, and not before the thrust is settled (bin_statistics.hpp). A
/// step that does not settle is averaged over the shortest window at its end, and is flagged. Load-cell samples are
/// placed in time by ClockMap and summed in bins that begin at the command (cell_stream.hpp). Thrust: sign · (mean
/// counts - zero) / counts per newton. Torque: about the direction of the thrust, likewise. Standard uncertainty: of
/// the mean of correlated samples (bin_statistics.hpp) and of the zero. Effective number of samples: variance of the
/// samples over that of their mean; above the actual number for periodic noise. Zero: see zeros.hpp. A zero is valid
/// for one power-up of the box: after a restart each step takes the zero of its own power-up if there is one, and is
/// flagged. Then the movement of the zero is unknown, which flags all steps, as do zeros that drifted or are too
/// uncertain. Standard deviations are those of the samples (n - 1). Speed is unsigned, positive in the direction of the
/// spin; glitches (motor_series.hpp) are left out and counted. Mean speed, its deviation and its uncertainty are the
/// reported ones times the clock gain of the run's header. Flags judge the reported speed, which the module controls. A
/// motor channel without a reading in the window gives NaN.
///
/// An aborted run gives the steps before the interrupted one. Throws RecordError if a run with steps has no load-cell
/// samples in any zero window, or its scale is invalid.
[[nodiscard]] std::vector<StepMean> reduce(const RunRecording& run);
[[nodiscard]] std::vector<StepMean> reduce(const RunRecording& run, const LoadCellColumns& cell);

/// As reduce(), with the check of the zeros.
[[nodiscard]] Reduced reduce_with_zeros(const RunRecording& run);

/// For RunWriter::finish(): the time of each sample, and thrust and speed in bins of 10 ms. No plot of a run whose
/// scale is invalid.
[[nodiscard]] RunViews views_of(const RunRecording& run, const LoadCellColumns& cell);

/// The changes of speed of the steps that were held to their end, for estimate_lag(). Without a zero the thrust keeps
/// its offset.
[[nodiscard]] std::vector<Transition> transitions_of(const RunRecording& run);

}  // namespace kphi::results
