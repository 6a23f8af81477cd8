// Rows that average repetitions (means.csv): the runs behind them, as their columns describe the scatter.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/model/repeatability.hpp"
#include "fit/model/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// How many repetitions the rows of one occlusion average; nullopt: none, or they do not say.
[[nodiscard]] std::optional<int> repetitions_averaged(std::span<const results::StepMean> steps);

/// Whether there are averages of an unknown number of repetitions, as kphi wrote them before it told.
[[nodiscard]] bool averages_unknown(std::span<const results::StepMean> steps);

/// A run for each repetition, with the scatter that the rows tell, and how they scatter within.
struct AveragedRuns {
  std::vector<RunSums> runs;
  WithinRuns within;
};

/// Of the rows of one occlusion that go into `fit`, which was made of them one point each; x is its map divided by `k`.
/// nullopt unless they average two repetitions or more and tell their scatter.
[[nodiscard]] std::optional<AveragedRuns> averaged_runs(double phi_deg, std::span<const results::StepMean> rows,
                                                        const ThrustFit& fit, double k,
                                                        const results::ZeroMovement& movement);

}  // namespace kphi::fit
