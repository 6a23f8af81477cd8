#include "fit/flights/resampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "base/statistics.hpp"

namespace kphi::fit {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kFewestPairs = 100, kBlocks = 30;
constexpr int kIterations = 20;

double line_at(const FlightChannel& channel, std::size_t i, double t) {
  const double share = (t - channel.time_s[i]) / (channel.time_s[i + 1] - channel.time_s[i]);
  return channel.values[i] + share * (channel.values[i + 1] - channel.values[i]);
}

/// Mean of the line through the values, weighted by a triangle of ± h around t; `i`: the segment that holds t − h.
double triangle_mean(const FlightChannel& channel, std::size_t i, double t, double h, double longest_gap_s) {
  double sum = 0;
  for (; i + 1 < channel.time_s.size() && channel.time_s[i] < t + h; ++i) {
    if (channel.time_s[i + 1] - channel.time_s[i] > longest_gap_s) return kNoValue;
    const auto weighted = [&](double s) { return line_at(channel, i, s) * std::max(0.0, 1 - std::abs(s - t) / h) / h; };
    // On either side of t the integrand is a parabola, for which Simpson's rule is exact.
    for (const auto& [from, to] : {std::pair(t - h, t), std::pair(t, t + h)}) {
      const double a = std::max(from, channel.time_s[i]), b = std::min(to, channel.time_s[i + 1]);
      if (a < b) sum += (b - a) / 6 * (weighted(a) + 4 * weighted((a + b) / 2) + weighted(b));
    }
  }
  return sum;
}

struct Fit {
  double scale = 0, step = 0, u_step = 0, correlation = 0;
  std::size_t pairs = 0;
};

/// Between four values by Catmull and Rom's cubic; NaN beyond the ends.
double cubic_at(std::span<const double> x, double at) {
  if (!(at >= 1 && at < static_cast<double>(x.size()) - 2)) return kNoValue;
  const auto i = static_cast<std::size_t>(at);
  const double s = at - static_cast<double>(i), a = x[i - 1], b = x[i], c = x[i + 1], d = x[i + 2];
  return b + s / 2 * (c - a + s * (2 * a - 5 * b + 4 * c - d + s * (3 * (b - c) + d - a)));
}

/// y against x late by `delay` steps, and by how much the delay is to grow: y = scale (x − step x') + offset.
Fit linearised(std::span<const double> x, std::span<const double> y, double delay) {
  std::vector<double> value, slope, target;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double at = static_cast<double>(i) - delay;
    const double v = cubic_at(x, at), s = (cubic_at(x, at + 0.5) - cubic_at(x, at - 0.5));
    if (std::isnan(v) || std::isnan(s) || std::isnan(y[i])) continue;
    value.push_back(v), slope.push_back(s), target.push_back(y[i]);
  }
  Fit fit;
  fit.pairs = target.size();
  if (fit.pairs < kFewestPairs) return fit;
  const double mean_v = mean(value), mean_s = mean(slope), mean_y = mean(target);
  double vv = 0, vs = 0, ss = 0, vy = 0, sy = 0, yy = 0;
  for (std::size_t i = 0; i < fit.pairs; ++i) {
    const double v = value[i] -= mean_v, s = slope[i] -= mean_s, t = target[i] -= mean_y;
    vv += v * v, vs += v * s, ss += s * s, vy += v * t, sy += s * t, yy += t * t;
  }
  const double determinant = vv * ss - vs * vs;
  if (!(determinant > 1e-12 * vv * ss) || !(yy > 0)) return fit;
  fit.correlation = vy / std::sqrt(vv * yy);
  fit.scale = (vy * ss - sy * vs) / determinant;
  const double along_slope = (sy * vv - vy * vs) / determinant;
  fit.step = -along_slope / fit.scale;
  // By the scatter of what each block of time pulls: whatever the correlation of residuals within a block.
  std::array<double, kBlocks> pulls{};
  for (std::size_t i = 0; i < fit.pairs; ++i) {
    const double residual = target[i] - fit.scale * value[i] - along_slope * slope[i];
    pulls[i * kBlocks / fit.pairs] += residual * (slope[i] - vs / vv * value[i]);
  }
  double squares = 0;
  for (const double pull : pulls) squares += pull * pull;
  fit.u_step = std::sqrt(squares * kBlocks / (kBlocks - 1)) * vv / determinant / std::abs(fit.scale);
  return fit;
}

double correlation_at(std::span<const double> x, std::span<const double> y, std::ptrdiff_t lag) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  const auto size = static_cast<std::ptrdiff_t>(y.size());
  for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(0, lag); i < std::min(size, size + lag); ++i) {
    const double a = x[static_cast<std::size_t>(i - lag)], b = y[static_cast<std::size_t>(i)];
    if (std::isnan(a) || std::isnan(b)) continue;
    n += 1, sx += a, sy += b, sxx += a * a, sxy += a * b, syy += b * b;
  }
  const double spread = (n * sxx - sx * sx) * (n * syy - sy * sy);
  return n >= static_cast<double>(kFewestPairs) && spread > 0 ? (n * sxy - sx * sy) / std::sqrt(spread) : 0;
}

}  // namespace

double period_of(const FlightChannel& channel) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < channel.time_s.size(); ++i) steps.push_back(channel.time_s[i] - channel.time_s[i - 1]);
  return steps.empty() ? 0 : upper_median(std::move(steps));
}

TimeGrid common_grid(std::span<const FlightChannel* const> channels, double step_s) {
  double begin = -INFINITY, end = INFINITY;
  for (const FlightChannel* channel : channels) {
    if (channel->time_s.empty()) return {0, step_s, 0};
    begin = std::max(begin, channel->time_s.front());
    end = std::min(end, channel->time_s.back());
  }
  if (!(end >= begin) || !(step_s > 0)) return {0, step_s, 0};
  const double count = std::floor((end - begin) / step_s) + 1;
  if (!(count <= static_cast<double>(kMostFlightValues)))
    throw FitError("the channels of the flight log last too long for one grid of times; cut the log");
  return {begin, step_s, static_cast<std::size_t>(count)};
}

std::vector<double> resample(const FlightChannel& channel, const TimeGrid& grid, double longest_gap_s) {
  std::vector<double> values(grid.count, kNoValue);
  const std::vector<double>& times = channel.time_s;
  if (times.size() < 2) return values;
  const double h = period_of(channel) < grid.step_s ? grid.step_s : 0;
  std::size_t i = 0;
  for (std::size_t k = 0; k < grid.count; ++k) {
    const double t = grid.time(k);
    if (t - h < times.front() || t + h > times.back()) continue;
    while (i + 2 < times.size() && times[i + 1] <= t - h) ++i;
    if (h > 0)
      values[k] = triangle_mean(channel, i, t, h, longest_gap_s);
    else if (times[i + 1] - times[i] <= longest_gap_s)
      values[k] = line_at(channel, i, t);
  }
  return values;
}

std::optional<Delay> delay_between(std::span<const double> x, std::span<const double> y, double step_s,
                                   double longest_s) {
  if (x.size() != y.size() || !(step_s > 0) || !(longest_s >= step_s)) return std::nullopt;
  const auto most =
      static_cast<std::ptrdiff_t>(std::min(std::floor(longest_s / step_s), static_cast<double>(x.size()) / 2));
  std::ptrdiff_t best = 0;
  double highest = 0;
  for (std::ptrdiff_t lag = -most; lag <= most; ++lag)
    if (const double r = std::abs(correlation_at(x, y, lag)); r > highest) highest = r, best = lag;
  if (highest == 0 || std::abs(best) == most) return std::nullopt;
  double delay = static_cast<double>(best);
  Fit fit;
  for (int i = 0; i < kIterations; ++i) {
    fit = linearised(x, y, delay);
    if (fit.scale == 0) return std::nullopt;
    const double step = std::clamp(fit.step, -0.5, 0.5);
    delay += step;
    if (std::abs(step) < 1e-6) break;
  }
  return Delay{delay * step_s, fit.u_step * step_s, fit.scale, fit.correlation};
}

}  // namespace kphi::fit
