// Both ends of an interval that holds most of many samples, without sorting them.
#pragma once

#include <span>
#include <vector>

namespace kphi::fit {

/// Arithmetic mean and the deviation with n − 1.
struct Scatter {
  double mean = 0, deviation = 0;
};

struct TailPercentiles {
  double lower = 0, upper = 0;
};

/// At least two samples.
[[nodiscard]] Scatter scatter_of(std::span<const double> samples);

/// The samples whose rank among n is nearest to (1 ∓ level)/2 of n − 1. NaN where one of them, or the scatter, is.
/// `scatter` is theirs: what lies far from the mean is picked first, so that little is left to order; another one costs
/// time only. `picked` is room to work in. level: 0 to 1.
[[nodiscard]] TailPercentiles tail_percentiles(std::span<const double> samples, const Scatter& scatter, double level,
                                               std::vector<double>& picked);

}  // namespace kphi::fit
