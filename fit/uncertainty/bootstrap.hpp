// Bootstrap by run: whole runs are drawn with replacement within each φ, because the errors that the steps of a run
// share (mounting, air) do not average out. Works on the sums of each run, so a resample costs a few additions. With
// three runs a percentile interval is too narrow by √(2/3): it checks the budget and does not replace it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "fit/model/line_fit.hpp"
#include "fit/model/repeatability.hpp"

namespace kphi::fit {

struct BootstrapOptions {
  std::size_t resamples = 10000;
  std::uint64_t seed = 1;
};

struct BootstrapInterval {
  std::string quantity;  ///< "K_T", "k(45 deg)", "intercept", "slope"
  double value = 0;      ///< of the data
  double standard_error = 0;
  double lower = 0, upper = 0;  ///< percentiles of 95 %
};

/// Of every k, and of the line through them with the weights of its fit. `angles` ascending, as `line`. The same
/// arguments give the same numbers.
[[nodiscard]] std::vector<BootstrapInterval> bootstrap(std::span<const AngleScatter> angles, const LineWeights& line,
                                                       const BootstrapOptions& options = {});

}  // namespace kphi::fit
