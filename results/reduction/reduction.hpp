// From a raw run to its step means: a pure function of the run file, so that live and replay give the same bytes.
#pragma once

#include <vector>

#include "results/records.hpp"
#include "results/reduction/zeros.hpp"
#include "results/run_reader.hpp"
#include "results/step_mean.hpp"

namespace kphi::results {

struct Reduced {
  std::vector<StepMean> steps;
  ZeroCheck zero;
};

/// One mean per step that was held to its end, in the order of the commands.
///
/// Lag: how much later the thrust shows than the speed, from all steps of the run (lag.hpp). Thrust and torque are
/// averaged over one window, and whatever the module reports over the window that was so much earlier. Where the lag is
/// unknown the two are the same, and the steps say so.
/// Window of a step: to the next command, from the minimum discard and the lag after its own, not before the first
/// speed within 1 % (at least 2 rad/s) of the command, and not before the thrust is settled (settling.hpp). A step
/// that does not settle is averaged over the least window at its end, and is flagged.
/// Load-cell samples are placed by ClockMap and summed in bins that begin at the command (cell_stream.hpp).
/// Thrust: sign · (mean counts - zero) / counts per newton. Torque: about the direction of the thrust, likewise.
/// Its standard uncertainty: that of the mean of correlated samples (mean_error.hpp) and that of the zero. Effective
/// number of samples: variance of the samples over that of their mean; more than there are when the noise is periodic.
/// Zero: see zeros.hpp. A zero holds for one power-up of the box: when the box started anew in the run, each step takes
/// that of its own power-up if there is one, and all after the first are flagged. Nobody knows then how far the zero
/// moved: all steps are flagged. Zeros that drifted or are not known
/// well (zeros.hpp) flag all steps of the run.
/// Standard deviations are those of the samples (n - 1). Speed is unsigned: positive in the direction of the spin;
/// glitches (motor_series.hpp) are left out and counted.
/// Mean speed, its deviation and its uncertainty are the reported ones times the gain of the module's clock, as far as
/// the run's header knows it. Flags judge the reported speed, which is what the module
/// holds to the command. A motor channel without a reading in the window gives NaN.
///
/// An aborted run gives the steps before the one that was cut short. Throws RecordError when a run with steps holds no
/// load-cell samples in any zero window, or its scale cannot be used.
[[nodiscard]] std::vector<StepMean> reduce(const RunRecording& run);

/// The same, with what was found about the zeros.
[[nodiscard]] Reduced reduce_with_zeros(const RunRecording& run);

/// The same bits without a record of each sample: those of a window are read when it is their turn.
[[nodiscard]] Reduced reduce_with_zeros(RunFile run);

}  // namespace kphi::results
