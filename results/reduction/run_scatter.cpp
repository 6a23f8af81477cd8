#include "results/reduction/run_scatter.hpp"

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"

namespace kphi::results {

namespace {

/// χ² of the runs about the mean of their occlusion if the variance between runs were larger by `beyond`.
double chi_squared(std::span<const std::vector<RunShare>> occlusions, double beyond) {
  double sum = 0;
  for (const auto& runs : occlusions) {
    const double n = static_cast<double>(runs.size());
    if (n < 2) continue;
    double mean = 0, variances = 0;
    for (const RunShare& run : runs) {
      mean += run.k / n;
      variances += run.variance + beyond;
    }
    for (const RunShare& run : runs) {
      const double variance = (run.variance + beyond) * (1 - 2 / n) + variances / (n * n);
      sum += square(run.k - mean) / variance * (n - 1) / n;
    }
  }
  return sum;
}

}  // namespace

double freedom_between(std::span<const std::vector<RunShare>> occlusions) {
  double freedom = 0;
  for (const auto& runs : occlusions) freedom += runs.empty() ? 0 : static_cast<double>(runs.size() - 1);
  return freedom;
}

double variance_between(std::span<const std::vector<RunShare>> occlusions) {
  const double freedom = freedom_between(occlusions);
  double low = 0, high = 1e-12;
  if (chi_squared(occlusions, 1e-16) <= freedom) return 0;
  while (chi_squared(occlusions, high) > freedom) high *= 4;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (chi_squared(occlusions, middle) > freedom ? low : high) = middle;
  }
  return high;
}

double freedom_of(double variance_between, std::span<const std::vector<RunShare>> occlusions) {
  if (!(variance_between > 0)) return freedom_between(occlusions);
  double freedom = 0;
  for (const auto& runs : occlusions) {
    double explained = 0;
    for (const RunShare& run : runs) explained += run.variance / static_cast<double>(runs.size());
    if (runs.size() > 1)
      freedom += static_cast<double>(runs.size() - 1) * square(variance_between / (variance_between + explained));
  }
  return std::max(1.0, freedom);
}

}  // namespace kphi::results
