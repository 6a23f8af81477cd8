#include "fit/logs/thrust_slope.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"

namespace kphi::fit {
namespace {

template <class Iterator>
std::optional<RestRows> rest_from(Iterator begin, Iterator end, SpeedSource source) {
  constexpr std::size_t kRowsForAZero = 10;
  std::vector<double> values;
  for (; begin != end && !(rpm_of(*begin, source).value_or(0) > 0); ++begin)
    if (motor_off(*begin, source)) values.push_back(begin->thrust_n);
  if (values.size() < kRowsForAZero) return std::nullopt;
  return RestRows{mean(values), std::sqrt(variance(values)), values.size()};
}

}  // namespace

std::string RestRows::words(const char* when) const {
  return fmt::format("{:.3f} N {} ({} rows, sd {:.3f} N)", mean_n, when, rows, sd_n);
}

std::optional<RestRows> rest_before(const StandLog& log, SpeedSource source) {
  return rest_from(log.rows.begin(), log.rows.end(), source);
}
std::optional<RestRows> rest_after(const StandLog& log, SpeedSource source) {
  return rest_from(log.rows.rbegin(), log.rows.rend(), source);
}

ThrustLine line_through(const std::vector<Point>& points) {
  const auto n = static_cast<double>(points.size());
  double mean_x = 0, mean_t = 0, sxx = 0, sxt = 0, stt = 0;
  for (const Point& point : points) {
    mean_x += square(point.speed_rad_s) / n;
    mean_t += point.thrust_n / n;
  }
  for (const Point& point : points) {
    const double x = square(point.speed_rad_s) - mean_x, t = point.thrust_n - mean_t;
    sxx += x * x, sxt += x * t, stt += t * t;
  }
  ThrustLine line;
  if (!(sxx > 0)) return {0, mean_t, INFINITY, stt, 0};
  line.k = sxt / sxx;
  line.offset = mean_t - line.k * mean_x;
  line.squares = std::max(0.0, stt - line.k * sxt);
  line.u_offset = n > 2 ? std::sqrt(line.squares / (n - 2) * (1 / n + mean_x * mean_x / sxx)) : INFINITY;
  line.correlation = stt > 0 ? sxt / std::sqrt(sxx * stt) : 0;
  return line;
}

ThrustSign sign_of(const std::vector<Point>& points) {
  constexpr double kAlike = 1.15;  // speeds
  constexpr double kSurely = 4;    // standard errors of a correlation
  double low = INFINITY, high = 0, sum = 0;
  for (const Point& point : points) {
    low = std::min(low, point.speed_rad_s), high = std::max(high, point.speed_rad_s);
    sum += point.thrust_n * square(point.speed_rad_s);
  }
  if (high < kAlike * low || points.size() < 2) return sum < 0 ? ThrustSign::cannot_tell : ThrustSign::rises;
  const ThrustLine line = line_through(points);
  if (sum > 0 && line.correlation > -0.5) return ThrustSign::rises;
  const double noise = kSurely / std::sqrt(static_cast<double>(points.size()));
  if (std::abs(line.correlation) < std::min(noise, 0.9)) return ThrustSign::cannot_tell;
  return line.correlation > 0 ? ThrustSign::rises : ThrustSign::falls;
}

}  // namespace kphi::fit
