#include "fit/numerics/tail_percentiles.hpp"

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
  std::size_t lows = 0, highs = 0;
  for (const double sample : samples) {
    picked[lows] = sample;
    picked[n - 1 - highs] = sample;
    lows += sample < low;
    highs += sample > high;
  }
  const auto lowest = std::span(picked).first(lows), highest = std::span(picked).last(highs);
  if (lower_rank < lows && upper_rank >= n - highs)
    return {sample_of_rank(lowest, lower_rank), sample_of_rank(highest, upper_rank - (n - highs))};
  std::copy(samples.begin(), samples.end(), picked.begin());
  const double lower = sample_of_rank(picked, lower_rank);
  return {lower, sample_of_rank(picked, upper_rank)};
}

}  // namespace kphi::fit
