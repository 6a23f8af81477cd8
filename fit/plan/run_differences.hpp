// The repetitions of one occlusion against each other, step by step: each run differs from their mean by a factor
// (mounting, air), a zero, and the noise of its steps, whose memory is that of science.md, eq. 29.
#pragma once

#include <span>
#include <vector>

#include "results/step_mean.hpp"

namespace kphi::fit {

/// One step as all repetitions have it.
struct SharedStep {
  double thrust_n = 0;  ///< mean over the runs
  double x = 0;         ///< ω², mean
  double noise_n2 = 0;  ///< variance between the runs, without factor and zero
  /// What a zero that wanders between its two measurements adds to that, per variance of its movement in the run.
  double of_wander = 0;
  std::vector<const results::StepMean*> of_runs;
};

struct RunDifferences {
  std::vector<SharedStep> steps;  ///< ascending in number; empty with one run, or fewer than four steps in common
  double neighbours_n2 = 0;       ///< covariance of that noise between neighbouring steps, mean
  double neighbours_of_wander = 0;
};

/// `steps` of one occlusion. They must outlive the result.
[[nodiscard]] RunDifferences run_differences(std::span<const results::StepMean> steps);

}  // namespace kphi::fit
