// Bootstrap by run: whole runs are drawn with replacement within each φ, because what one run shares (mounting, air)
// does not average out over its steps. Works on the sums of each run, so a resample costs a few additions.
// With three runs a percentile interval is narrow by nature (√(2/3)); it is a check of the budget, not its replacement.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fit/model/line_fit.hpp"
#include "fit/model/run_sums.hpp"

namespace kphi::fit {

struct BootstrapOptions {
  std::size_t resamples = 10000;
  std::uint64_t seed = 1;
  double level = 0.95;
};

struct BootstrapInterval {
  std::string quantity;  ///< "K_T", "k(45 deg)", "intercept", "slope"
  double value = 0;      ///< of the data themselves
  double standard_error = 0;
  double lower = 0, upper = 0;  ///< percentiles
};

/// Of every k, and of the line through them with the weights that it was fitted with, held fixed.
/// `runs` sorted by φ. The same arguments give the same numbers.
[[nodiscard]] std::vector<BootstrapInterval> bootstrap(std::span<const RunSums> runs, const LineWeights& line,
                                                       const BootstrapOptions& options = {});

}  // namespace kphi::fit
