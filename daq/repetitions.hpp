// Three times the same, averaged.
#pragma once

#include <span>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::daq {

/// One row per propeller, occlusion and step, in the order of first appearance, with repetition = 0.
/// T = k ω² is linear in ω², so the averaged speed is the root of the mean of the squares, and thrust over speed² of
/// the row is the k that the repetitions have together. Thrust, torque, zero, electrical and thermal readings, the
/// commanded speed and the window's ends: arithmetic means over the repetitions that have them. Standard deviations:
/// root mean square (the spread within a step, not between repetitions). Numbers of samples: sums. Doubts: those of any
/// repetition.
[[nodiscard]] std::vector<results::StepMean> average_repetitions(std::span<const results::StepMean> steps);

}  // namespace kphi::daq
