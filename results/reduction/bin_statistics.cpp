#include "results/reduction/bin_statistics.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/statistics.hpp"

namespace kphi::results {
namespace {

constexpr double kWindowing = 1.5;  // S: correlations die within S times the integrated time
constexpr std::size_t kSwing = 10;
constexpr double kSwingSurely = 2.5;  // standard deviations of a correlation by chance
constexpr std::size_t kLeastWaves = 3;

double covariance(std::span<const double> centred, std::size_t lag) {
  const std::size_t n = centred.size() - lag;
  return std::inner_product(centred.begin(), centred.begin() + static_cast<std::ptrdiff_t>(n),
                            centred.begin() + static_cast<std::ptrdiff_t>(lag), 0.0) /
         static_cast<double>(n);
}

/// Whether the statistical error of the sum outgrows what lies beyond `window`.
bool far_enough(double half_plus_sum, std::size_t window, double n) {
  const double w = static_cast<double>(window);
  const double tau =
      half_plus_sum <= 0.5 ? 1e-12 : kWindowing / std::log((half_plus_sum + 0.5) / (half_plus_sum - 0.5));
  return std::exp(-w / tau) < tau / std::sqrt(w * n);
}

/// Whether values oppose those before them, or those a few places before, by more than chance.
bool swings(std::span<const double> centred, double variance) {
  const double chance = variance / std::sqrt(static_cast<double>(centred.size()));
  if (covariance(centred, 1) < -chance) return true;
  for (std::size_t lag = 2; lag <= std::min(kSwing, centred.size() / 2); ++lag) {
    if (covariance(centred, lag) < -kSwingSurely * chance) return true;
  }
  return false;
}

/// Sum of values · cos π wave (i + 1/2)/n.
double projection(std::span<const double> values, std::size_t wave) {
  const double angle = M_PI * static_cast<double>(wave) / static_cast<double>(values.size());
  const double twice = 2 * std::cos(angle);
  double before = std::cos(0.5 * angle), cosine = before, sum = 0;
  for (const double value : values) {
    sum += value * cosine;
    before = std::exchange(cosine, twice * cosine - before);
  }
  return sum;
}

/// By the cosines with up to n/8 half waves: what fluctuates so slowly does not average out.
void take_slow_cosines(std::span<const double> centred, int fitted, MeanError& error) {
  const double n = static_cast<double>(centred.size());
  const std::size_t waves = std::max(centred.size() / 8, static_cast<std::size_t>(fitted) + kLeastWaves);
  double power = 0;
  for (std::size_t wave = 1; wave <= waves; ++wave) power += 2 * std::pow(projection(centred, wave), 2) / n;
  error.freedom = static_cast<double>(waves) - (fitted - 1);
  error.u = std::sqrt(power / error.freedom / n);
}

constexpr double kSearches = 20;  // begins that are tried within what was planned
// Of 28 pairs of the means of 8 blocks. By chance 20 or more rise, or fall, in 0.7 % of what has no trend, and so in
// both halves of a step in one of 10,000.
constexpr std::size_t kBlocks = 8;
constexpr int kOneWay = 20;

/// Least-squares line through the values that are not NaN, x in places from the first.
struct Line {
  explicit Line(std::span<const double> values) {
    const auto for_each = [&](auto&& take) {
      for (std::size_t i = 0; i < values.size(); ++i)
        if (!std::isnan(values[i])) take(static_cast<double>(i), values[i]);
    };
    double n = 0;
    for_each([&](double x, double y) { ++n, middle += x, mean += y; });
    middle /= n, mean /= n;
    double product = 0;
    for_each([&](double x, double y) {
      product += (x - middle) * y;
      spread += (x - middle) * (x - middle);
    });
    if (spread > 0) slope = product / spread;
  }
  [[nodiscard]] double at(double place) const { return mean + slope * (place - middle); }

  double middle = 0, mean = 0;  ///< NaN without values
  double spread = 0, slope = 0;
};

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
    const Line line(piece);
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
    means.push_back(Line(values.subspan(begin, end - begin)).mean);  // NaN is neither larger nor smaller
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
  const Line line(values);
  const double bins = static_cast<double>(values.size());
  const double change = std::abs(line.slope) * bins;
  const double certain = t * std::sqrt(noise.variance / line.spread) * bins;
  return change <= std::max(certain, kSteadyShare * std::abs(line.mean));
}

}  // namespace

MeanError mean_error(std::span<const double> values, int fitted) {
  MeanError error;
  const double n = static_cast<double>(values.size());
  if (values.empty()) return error;
  error.mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  if (values.size() < kLeastValues) return error;
  std::vector<double> centred(values.begin(), values.end());
  for (double& value : centred) value -= error.mean;
  const double variance = covariance(centred, 0);
  error.freedom = n - 1;
  error.u = 0;
  if (!(variance > 0)) return error;

  if (swings(centred, variance)) {
    take_slow_cosines(centred, fitted, error);
    error.correlation = error.u * error.u * n / variance;
    return error;
  }
  const std::size_t widest = std::max<std::size_t>(values.size() / 4, 1);
  double sum = 0.5;
  std::size_t window = 0;
  while (window < widest) {
    ++window;
    sum += covariance(centred, window) / variance;
    if (far_enough(sum, window, n)) break;
  }
  // The mean that was subtracted took its own variance along.
  const double width = 2.0 * static_cast<double>(window) + 1;
  error.correlation = std::max(2 * sum, 1 / n) * (1 + width / n);
  error.u = std::sqrt(variance * error.correlation / n);
  error.freedom = std::max(n / width - 1, 1.0);
  return error;
}

std::vector<double> without_trend(std::span<const double> values) {
  const Line line(values);
  std::vector<double> rest(values.begin(), values.end());
  for (std::size_t i = 0; i < rest.size(); ++i) rest[i] -= line.at(static_cast<double>(i));
  return rest;
}

double student(double freedom, double confidence) {
  if (!(freedom > 0)) return std::numeric_limits<double>::quiet_NaN();
  return boost::math::quantile(boost::math::students_t(freedom), 0.5 + 0.5 * confidence);
}

double joint_freedom(double u1, double freedom1, double u2, double freedom2) {
  const double square = u1 * u1 + u2 * u2;
  const double share = (u1 > 0 ? u1 * u1 * u1 * u1 / freedom1 : 0) + (u2 > 0 ? u2 * u2 * u2 * u2 / freedom2 : 0);
  return share > 0 ? square * square / share : std::min(freedom1, freedom2);
}

Settling settle(std::span<const double> thrust, std::size_t first, std::size_t planned, double bin_s) {
  const std::size_t n = thrust.size();
  const auto half_second = static_cast<std::size_t>(std::llround(kLeastWindow / bin_s));
  const std::size_t least = std::max(std::min(half_second, planned / 2), kLeastValues);
  if (n < first + least) return {std::min(first, n), false};
  const std::size_t parts = n >= first + 2 * least ? 2 : 1;
  const Noise noise = noise_of(thrust.subspan(n - parts * least), parts);
  if (!(noise.freedom > 0)) return {n - least, false};
  const double t = student_95(noise.freedom);
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(planned) / kSearches));
  for (std::size_t begin = first; begin + least <= n; begin += stride) {
    if (steady(thrust.subspan(begin), noise, t)) return {begin, true};
  }
  return {n - least, steady(thrust.last(least), noise, student(noise.freedom, kUnsettledConfidence))};
}

bool drifts(std::span<const double> thrust) {
  const std::size_t half = thrust.size() / 2;
  if (half < 2 * kLeastValues) return false;
  const auto early = thrust.first(half), late = thrust.subspan(half, half);
  const int pairs_early = rising_pairs(early), pairs_late = rising_pairs(late);
  if (std::min(std::abs(pairs_early), std::abs(pairs_late)) < kOneWay || (pairs_early > 0) != (pairs_late > 0)) {
    return false;
  }
  const double change = Line(late).slope * static_cast<double>(half);
  return (change > 0) == (pairs_late > 0) && std::abs(change) > kDriftShare * std::abs(Line(thrust).mean);
}

}  // namespace kphi::results
