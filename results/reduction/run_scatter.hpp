// How the k of runs scatter about the mean of their occlusion.
#pragma once

#include <span>
#include <vector>

namespace kphi::results {

/// k of one run as a share of the k of its occlusion, with the variance that its noise and its zero explain.
struct RunShare {
  double k = 0;
  double variance = 0;
  double per_n = 0;            ///< change of that share for 1 N of zero
  double offset_n = 0;         ///< where the line of the run's thrust on ω² begins, N
  double offset_variance = 0;  ///< what noise and zero explain of that, N²; 0: offset not known
};

/// What runs scatter beyond their noise and their zero: standard deviations and the degrees of freedom behind them.
struct RunScatter {
  double share = 0, share_freedom = 0;  ///< in proportion to k: mounting, bearing, air
  double zero_n = 0, zero_freedom = 0;  ///< added to the thrust, N: a zero that errs by more than was told of it
};

/// Degrees of freedom of the scatter between runs, pooled over occlusions: runs less one for each.
[[nodiscard]] double freedom_between(std::span<const std::vector<RunShare>> occlusions);

enum class Keep {
  averaged,   ///< with and without each component, averaged by how likely the runs are (weights of Akaike)
  likeliest,  ///< each is as large as is likeliest
};

/// Both by restricted maximum likelihood from k and offset of the runs about the means of their occlusion, pooled over
/// occlusions (science.md, eq. 14 to 16). 0 without repetitions.
[[nodiscard]] RunScatter scatter_between(std::span<const std::vector<RunShare>> occlusions, Keep keep = Keep::averaged);
/// How well runs that explain so much of their variance would tell a scatter of this size.
[[nodiscard]] RunScatter scatter_expected(double share, double zero_n,
                                          std::span<const std::vector<RunShare>> occlusions);

}  // namespace kphi::results
