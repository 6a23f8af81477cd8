#include "fit/tail_percentiles.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace kphi::fit {
namespace {

// In deviations from the mean. A normal sample has 11 % of itself beyond it on each side: few to order, and more than
// the tail of any interval in use.
constexpr double kFar = 1.2;

Eigen::Map<const Eigen::ArrayXd> array_of(std::span<const double> samples) {
  return {samples.data(), static_cast<Eigen::Index>(samples.size())};
}

double sample_of_rank(std::span<double> samples, std::size_t rank) {
  const auto at = samples.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(samples.begin(), at, samples.end());
  return *at;
}

}  // namespace

Scatter scatter_of(std::span<const double> samples) {
  const auto values = array_of(samples);
  const double mean = values.mean();
  return {mean, std::sqrt((values - mean).square().sum() / static_cast<double>(samples.size() - 1))};
}

TailPercentiles tail_percentiles(std::span<const double> samples, const Scatter& scatter, double level,
                                 std::vector<double>& picked) {
  const std::size_t n = samples.size();
  if (n == 0 || !std::isfinite(scatter.deviation))
    return {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};
  const auto rank = [&](double share) { return static_cast<std::size_t>(share * static_cast<double>(n - 1) + 0.5); };
  const std::size_t lower_rank = rank((1 - level) / 2), upper_rank = rank((1 + level) / 2);
  const double far = kFar * std::abs(scatter.deviation), low = scatter.mean - far, high = scatter.mean + far;
  picked.resize(n);
  // The low ones from the front, the high ones from the back; each sample is written, few advance the place.
  double *front = picked.data(), *back = front + n - 1;
  for (const double sample : samples) {
    *front = sample;
    *back = sample;
    front += sample < low;
    back -= sample > high;
  }
  const std::span lowest(picked.data(), front), highest(back + 1, picked.data() + n);
  if (lower_rank < lowest.size() && upper_rank >= n - highest.size())
    return {sample_of_rank(lowest, lower_rank), sample_of_rank(highest, upper_rank - (n - highest.size()))};
  std::copy(samples.begin(), samples.end(), picked.begin());
  const double lower = sample_of_rank(picked, lower_rank);
  return {lower, sample_of_rank(picked, upper_rank)};
}

}  // namespace kphi::fit
