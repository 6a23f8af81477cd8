// Repetitions averaged, step by step.
#pragma once

#include <span>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::results {

/// The rows of means.csv: one per propeller, occlusion and step, in the order of first appearance, with repetition = 0.
/// T = k ω² is linear in ω², so the averaged speed is the root of the mean of the squares, and thrust over speed² of
/// the row is the common k of the repetitions. Thrust, torque, zero, electrical and thermal readings, the commanded
/// speed, the lag and the window's ends: arithmetic means over the repetitions that have them. Standard deviations:
/// root mean square (the spread within a step, not between repetitions). Standard uncertainties: of the mean, assuming
/// that the repetitions differ only by the noise within them; how much they differ beyond it, k_scatter_share and
/// thrust_scatter_n tell. Movement of the zero: root mean square. Numbers of samples: sums. Flags: those of any
/// repetition.
/// Averages leave out a flagged step if another repetition has a good one (repetitions_averaged, repetitions_left_out),
/// by the rule of the fit: a step is left out for a flag, which names a cause, never for being far from the others
/// (JCGM 100, 3.4.7 and 4.2: the scatter of repetitions is their uncertainty).
[[nodiscard]] std::vector<StepMean> means_of(std::span<const StepMean> steps);

}  // namespace kphi::results
