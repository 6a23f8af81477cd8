#include "daq/settling.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "daq/mean_error.hpp"

namespace kphi::daq {
namespace {

constexpr double kSearches = 20;  // begins that are tried within what was planned
constexpr double kSignificant = 4;

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

/// Variance that one bin contributes to the variance of a long mean, about the line.
struct Noise {
  double variance = std::numeric_limits<double>::quiet_NaN();
  double freedom = 0;
};

Noise noise_about(const Line& line, std::span<const double> values) {
  std::vector<double> residuals;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isnan(values[i])) residuals.push_back(values[i] - line.at(static_cast<double>(i)));
  }
  const MeanError error = mean_error(residuals);
  return {error.u * error.u * static_cast<double>(residuals.size()), error.freedom};
}

/// A jump or a bend makes noise of what is none; the quarter with the least tells what noise there is.
double quietest_quarter(std::span<const double> values) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t part = 0; part < 4; ++part) {
    const auto quarter = values.subspan(part * (values.size() / 4), values.size() / 4);
    const Noise noise = noise_about(line_through(quarter), quarter);
    if (noise.freedom > 0) least = std::min(least, noise.variance);
  }
  return least;
}

/// `variance_95`: of the noise, times the square of Student's t.
bool steady(const Line& line, double bins, double variance_95) {
  const double change = std::abs(line.slope()) * bins;
  const double certain = std::sqrt(variance_95 / line.spread()) * bins;
  return change <= std::max(certain, kSteadyShare * std::abs(line.mean()));
}

}  // namespace

Settling settle(std::span<const double> thrust, std::size_t first, std::size_t planned, double bin_s) {
  const std::size_t n = thrust.size();
  const auto half_second = static_cast<std::size_t>(std::llround(kLeastWindow / bin_s));
  const std::size_t least = std::max(std::min(half_second, planned / 2), kLeastValues);
  if (n < first + least) return {std::min(first, n), false};
  const auto tail = thrust.subspan(n - least);
  const Noise noise = noise_about(line_through(tail), tail);
  if (!(noise.freedom > 0)) return {n - least, false};
  const double t = student_95(noise.freedom);
  const auto stride = std::max<std::size_t>(1, static_cast<std::size_t>(static_cast<double>(planned) / kSearches));
  for (std::size_t begin = first; begin + least <= n; begin += stride) {
    const auto rest = thrust.subspan(begin);
    if (steady(line_through(rest), static_cast<double>(rest.size()), t * t * noise.variance)) return {begin, true};
  }
  return {n - least, false};
}

bool drifts(std::span<const double> thrust) {
  const std::size_t half = thrust.size() / 2;
  if (half < 2 * kLeastValues) return false;
  const double quiet = quietest_quarter(thrust);
  double change[2];
  bool certain = true;
  for (std::size_t part = 0; part < 2; ++part) {
    const Line line = line_through(thrust.subspan(part * half, half));
    change[part] = line.slope() * static_cast<double>(half);
    certain &= std::abs(line.slope()) > kSignificant * std::sqrt(quiet / line.spread());
  }
  const double level = std::abs(line_through(thrust).mean());
  return certain && change[0] * change[1] > 0 && std::abs(change[1]) > kDriftShare * level;
}

}  // namespace kphi::daq
