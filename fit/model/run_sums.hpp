// What one run contributes to k: its weighted sums, from which any mixture of runs gives its k by two additions.
#pragma once

#include <span>
#include <vector>

#include "fit/model/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

struct RunSums {
  double phi_deg = 0;
  int repetition = 0;
  double xt = 0;            ///< Σ w x T; x = ω², or what the map has in its place
  double xx = 0;            ///< Σ w x²
  double x = 0;             ///< Σ w x
  double zero_moved_n = 0;  ///< how far the zero wandered over the run; 0: not known
  std::size_t steps = 0;

  [[nodiscard]] double k() const { return xt / xx; }  ///< N/(rad/s)²
};

/// What the steps of one φ scatter within their runs.
struct WithinRuns {
  double variance = 0;  ///< of the k of one run, (N/(rad/s)²)²
  double freedom = 0;
};

/// One per repetition, ascending. `fit` was made of `steps`, one point each in the same order; the map it found, scaled
/// to `k`, is what x stands for.
[[nodiscard]] std::vector<RunSums> sums_of_runs(double phi_deg, std::span<const results::StepMean> steps,
                                                const ThrustFit& fit, double k);

/// From the interaction of step and repetition, so that neither what a run shares nor what a map lacks enters; from a
/// single run, from its residuals. Each step counts by its own scatter (MacKinnon, White 1985), as thrust scatters more
/// where it is high.
[[nodiscard]] WithinRuns scatter_within_runs(std::span<const results::StepMean> steps, const ThrustFit& fit, double k,
                                             std::span<const RunSums> runs);

}  // namespace kphi::fit
