// How well k repeats: noise within the runs, the zero's wandering, and what changes from run to run beyond the two
// (mounting, air, bearing), pooled over all occlusions as a share of k, since three repetitions alone say little.
#pragma once

#include <span>
#include <vector>

#include "fit/model/run_sums.hpp"
#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

/// Of one φ; standard uncertainties of the mean over its runs.
struct AngleScatter {
  double k = 0;
  std::vector<RunSums> runs;
  WithinRuns within;            ///< of one run
  double zero_u_n = 0;          ///< rectangular, half of how far each zero moved (JCGM 100, 4.3.7)
  double zero_sensitivity = 0;  ///< of k per N

  [[nodiscard]] double within_u() const;  ///< N/(rad/s)²
  [[nodiscard]] double zero_u() const { return zero_u_n * zero_sensitivity; }
};

struct Repeatability {
  std::vector<AngleScatter> angles;
  Estimate between;       ///< u: standard deviation from run to run as a share of k, beyond noise and zero; value 0
  bool repeated = false;  ///< at least one φ was measured more than once; otherwise `between` is not known

  /// Of k at angle i by everything that is independent from φ to φ, N/(rad/s)².
  [[nodiscard]] double independent_u(std::size_t i) const;
  /// Degrees of freedom behind those uncertainties, all of which share `between`.
  [[nodiscard]] double freedom() const;
};

[[nodiscard]] Repeatability repeatability(std::vector<AngleScatter> angles);

/// A run further from the others of its φ than chance explains. It stays in k, and in what repetitions scatter.
struct OutlyingRun {
  double phi_deg = 0;
  int repetition = 0;
  double share = 0;  ///< its k / mean of the others − 1
  double p = 1;      ///< of one of all runs so far off by chance
};

/// Each run against the mean of the others of its φ, by Student's test with what all other runs scatter (pooled over
/// φ, each with its own noise and zero), corrected for their number (Bonferroni); level 5 % for the campaign.
[[nodiscard]] std::vector<OutlyingRun> outlying_runs(const Repeatability& all);

[[nodiscard]] AngleScatter scatter_of_angle(double k, std::vector<RunSums> runs, const WithinRuns& within);

}  // namespace kphi::fit
