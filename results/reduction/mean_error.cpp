#include "results/reduction/mean_error.hpp"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

namespace kphi::results {
namespace {

constexpr double kWindowing = 1.5;  // S: correlations die within S times the integrated time
constexpr double kMostFreedom = 1e6;
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
  const double n = static_cast<double>(values.size());
  const double middle = 0.5 * (n - 1);
  double sum = 0, slope = 0, spread = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - middle;
    sum += values[i];
    slope += x * values[i];
    spread += x * x;
  }
  std::vector<double> rest(values.begin(), values.end());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    rest[i] -= sum / n + (spread > 0 ? slope / spread * (static_cast<double>(i) - middle) : 0);
  }
  return rest;
}

double student(double freedom, double confidence) {
  if (!(freedom > 0)) return std::numeric_limits<double>::quiet_NaN();
  return boost::math::quantile(boost::math::students_t(std::min(freedom, kMostFreedom)), 0.5 + 0.5 * confidence);
}

double MeanError::half_width_95() const { return student_95(freedom) * u; }

double joint_freedom(double u1, double freedom1, double u2, double freedom2) {
  const double square = u1 * u1 + u2 * u2;
  const double share = (u1 > 0 ? u1 * u1 * u1 * u1 / freedom1 : 0) + (u2 > 0 ? u2 * u2 * u2 * u2 / freedom2 : 0);
  return share > 0 ? square * square / share : std::min(freedom1, freedom2);
}

}  // namespace kphi::results
