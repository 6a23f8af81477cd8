// How the k of runs scatter about the mean of their occlusion.
#pragma once

#include <span>
#include <vector>

namespace kphi::results {

/// k of one run as a share of the k of its occlusion, with the variance that its noise and its zero explain.
struct RunShare {
  double k = 0;
  double variance = 0;
};
/// Degrees of freedom of the scatter between runs, pooled over occlusions: runs less one for each.
[[nodiscard]] double freedom_between(std::span<const std::vector<RunShare>> occlusions);
/// Variance from run to run beyond the explained one, pooled over occlusions: the one at which χ² of the runs about the
/// mean of their occlusion has its expectation (Mandel, Paule, Anal. Chem. 42 (1970) 1194). 0 without repetitions.
[[nodiscard]] double variance_between(std::span<const std::vector<RunShare>> occlusions);
/// Degrees of freedom of that variance: fewer than between the runs where noise and zero explain much of their scatter
/// (twice its square over the variance of its estimate).
[[nodiscard]] double freedom_of(double variance_between, std::span<const std::vector<RunShare>> occlusions);

}  // namespace kphi::results
