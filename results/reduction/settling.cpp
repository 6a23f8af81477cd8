#include "results/reduction/settling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "results/reduction/mean_error.hpp"

namespace kphi::results {
namespace {

constexpr double kSearches = 20;  // begins that are tried within what was planned
// Of 28 pairs of the means of 8 blocks. By chance 20 or more rise, or fall, in 0.7 % of what has no trend, and so in
// both halves of a step in one of 10,000.
constexpr std::size_t kBlocks = 8;
constexpr int kOneWay = 20;

/// Least-squares line through the bins, x in bins from the first.
class Line {
 public:
  void add(double x, double y) {
    n_ += 1;
    x_ += x;
    y_ += y;
    xx_ += x * x;
    xy_ += x * y;
  }
  [[nodiscard]] double spread() const { return xx_ - x_ * x_ / n_; }
  [[nodiscard]] double slope() const { return spread() > 0 ? (xy_ - x_ * y_ / n_) / spread() : 0; }
  [[nodiscard]] bool empty() const { return n_ == 0; }
  [[nodiscard]] double mean() const { return y_ / n_; }
  [[nodiscard]] double at(double x) const { return mean() + slope() * (x - x_ / n_); }

 private:
  double n_ = 0, x_ = 0, y_ = 0, xx_ = 0, xy_ = 0;
};

Line line_through(std::span<const double> values) {
  Line line;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values[i])) line.add(static_cast<double>(i), values[i]);
  }
  return line;
}

/// Variance that one bin contributes to the variance of a long mean.
struct Noise {
  double variance = std::numeric_limits<double>::quiet_NaN();
  double freedom = 0;
};

/// About a line through each of `parts` equal parts: of a transient a line leaves little in half a second.
Noise noise_of(std::span<const double> values, std::size_t parts) {
  std::vector<double> residuals;
  for (std::size_t part = 0; part < parts; ++part) {
    const auto piece = values.subspan(part * (values.size() / parts), values.size() / parts);
    const Line line = line_through(piece);
    for (std::size_t i = 0; i < piece.size(); ++i) {
      if (!std::isnan(piece[i])) residuals.push_back(piece[i] - line.at(static_cast<double>(i)));
    }
  }
  const MeanError error = mean_error(residuals, static_cast<int>(2 * parts));
  return {error.u * error.u * static_cast<double>(residuals.size()), error.freedom};
}

/// Of the means of kBlocks equal parts: pairs in which the later one is larger less pairs in which it is smaller
/// (Kendall's S). How much they scatter does not matter, nor how far one of them jumps.
int rising_pairs(std::span<const double> values) {
  std::vector<double> means;
  for (std::size_t part = 0; part < kBlocks; ++part) {
    const std::size_t begin = values.size() * part / kBlocks, end = values.size() * (part + 1) / kBlocks;
    const Line line = line_through(values.subspan(begin, end - begin));
    if (!line.empty()) means.push_back(line.mean());
  }
  int pairs = 0;
  for (std::size_t i = 0; i < means.size(); ++i) {
    for (std::size_t j = i + 1; j < means.size(); ++j) {
      pairs += static_cast<int>(means[j] > means[i]) - static_cast<int>(means[j] < means[i]);
    }
  }
  return pairs;
}

/// Whether the slope is inside its own uncertainty, `t` standard ones, or too small to matter.
bool steady(std::span<const double> values, const Noise& noise, double t) {
  const Line line = line_through(values);
  const double bins = static_cast<double>(values.size());
  const double change = std::abs(line.slope()) * bins;
  const double certain = t * std::sqrt(noise.variance / line.spread()) * bins;
  return change <= std::max(certain, kSteadyShare * std::abs(line.mean()));
}

}  // namespace

Settling settle(std::span<const double> thrust, std::size_t first, std::size_t planned, double bin_s) {
  const std::size_t n = thrust.size();
  const auto half_second = static_cast<std::size_t>(std::llround(kLeastWindow / bin_s));
  const std::size_t least = std::max(std::min(half_second, planned / 2), kLeastValues);
  if (n < first + least) return {std::min(first, n), false};
  const auto tail = thrust.subspan(n - least);
  const std::size_t parts = n >= first + 2 * least ? 2 : 1;
  const Noise noise = noise_of(thrust.subspan(n - parts * least), parts);
  if (!(noise.freedom > 0)) return {n - least, false};
  const double t = student_95(noise.freedom);
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(planned) / kSearches));
  for (std::size_t begin = first; begin + least <= n; begin += stride) {
    if (steady(thrust.subspan(begin), noise, t)) return {begin, true};
  }
  return {n - least, steady(tail, noise, student(noise.freedom, kUnsettledConfidence))};
}

bool drifts(std::span<const double> thrust) {
  const std::size_t half = thrust.size() / 2;
  if (half < 2 * kLeastValues) return false;
  const auto early = thrust.first(half), late = thrust.subspan(half, half);
  const int pairs_early = rising_pairs(early), pairs_late = rising_pairs(late);
  if (std::min(std::abs(pairs_early), std::abs(pairs_late)) < kOneWay || (pairs_early > 0) != (pairs_late > 0)) {
    return false;
  }
  const double change = line_through(late).slope() * static_cast<double>(half);
  return (change > 0) == (pairs_late > 0) && std::abs(change) > kDriftShare * std::abs(line_through(thrust).mean());
}

}  // namespace kphi::results
