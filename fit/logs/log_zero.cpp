#include "fit/logs/log_zero.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "fit/logs/log_audit.hpp"

namespace kphi::fit {
namespace {

using results::kNotMeasured;

/// What the shape of real curves, whose k rises with speed, moves a k that is fitted with an offset: rms of 160 tared
/// logs of five-inch propellers (Series 1520, 10 motors, 8 propellers).
constexpr double kShapeOfCurves = 0.028;
/// Tared logs: their offset is at most 4 % of the largest thrust, and a power of ω fits at least twice as badly as the
/// offset does in none of them.
/// Four times as much noise of the offset is 5 % of k.
constexpr double kNoise = 0.0125;
constexpr double kOffsetOfTared = 0.05, kOffsetSeen = 0.015, kBetterThanPower = 0.4, kDeviations = 4;

/// Least squares of T = a ω^p over a: the smallest sum for any p from 1.2 to 3.
double squares_of_power(const std::vector<Point>& points) {
  double least = INFINITY, highest = 0;
  for (const Point& point : points) highest = std::max(highest, point.speed_rad_s);
  for (double power = 1.2; power <= 3.0; power += 0.02) {
    double yy = 0, yt = 0, tt = 0;
    for (const Point& point : points) {
      const double y = std::pow(point.speed_rad_s / highest, power);
      yy += y * y, yt += y * point.thrust_n, tt += square(point.thrust_n);
    }
    least = std::min(least, tt - yt * yt / yy);
  }
  return least;
}

double correlation_of_residuals(const std::vector<Point>& points, const ThrustLine& line) {
  constexpr std::size_t kMost = 5000;
  std::vector<double> residuals;
  for (std::size_t i = 0; i < std::min(points.size(), kMost); ++i)
    residuals.push_back(points[i].thrust_n - line.k * square(points[i].speed_rad_s) - line.offset);
  return residuals.size() < kRowsOfASeries ? 1 : correlation_time(residuals);
}

double highest_thrust(const std::vector<Point>& points) {
  double highest = 0;
  for (const Point& point : points) highest = std::max(highest, std::abs(point.thrust_n));
  return highest;
}

double typical_k_of(const ImportedTable& table, double zero_n) {
  double products = 0, fourth = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double x = square(table.speed_rad_s(i));
    products += x * (table.thrust_n(i) - zero_n), fourth += x * x;
  }
  return std::abs(products / fourth);
}

/// Of rows with the motor off, of which k must not depend too much.
ZeroOfLog tied_zero(double zero_n, double u_n, const ImportedTable& table) {
  constexpr double kSurely = 0.0125;  // four times as much is 5 % of k
  const bool known = u_n * k_per_zero(table) < kSurely * typical_k_of(table, zero_n);
  return {known ? ZeroOfLog::Source::motor_off : ZeroOfLog::Source::unknown, zero_n, u_n};
}

ZeroOfLog fitted_zero(const std::vector<Point>& points, bool series) {
  const ThrustLine line = line_through(points);
  double per_zero = 0, fourth = 0;
  for (const Point& point : points) per_zero += square(point.speed_rad_s), fourth += square(square(point.speed_rad_s));
  per_zero /= fourth;
  const double u = line.u_offset * std::sqrt(correlation_of_residuals(points, line)), largest = highest_thrust(points);
  const double share = std::abs(line.offset) / largest, power = squares_of_power(points);
  const bool better = line.squares < kBetterThanPower * power && share > kOffsetSeen;
  const bool large = share > kOffsetOfTared && line.squares <= power;
  if (line.correlation > 0.3 && std::abs(line.offset) > kDeviations * u && (better || large) && points.size() > 3)
    return {u * per_zero < kNoise * line.k ? ZeroOfLog::Source::fitted : ZeroOfLog::Source::unknown, line.offset,
            std::hypot(u, kShapeOfCurves * line.k / per_zero)};
  if (!series) return {};
  const double possible = std::max(std::abs(line.offset), u);
  // How far k is off if the zero is off by what the log allows.
  const bool unknown = !(possible * per_zero < 0.05 * std::abs(line.k));
  return {unknown ? ZeroOfLog::Source::unknown : ZeroOfLog::Source::as_written, 0, possible};
}

}  // namespace

double k_per_zero(const ImportedTable& table) {
  double squares = 0, fourth = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double x = square(table.speed_rad_s(i));
    squares += x, fourth += x * x;
  }
  return squares / fourth;
}

LogRest rest_of(const StandLog& log, SpeedSource source) {
  return {rest_before(log, source), rest_after(log, source), largest_thrust(log), log.rows.size()};
}

ZeroOfLog zero_of(const LogRest& rest, const ImportedTable& table, const RowSelection& selection) {
  const auto& [before, after, largest, rows] = rest;
  if (selection.tare_rows > 0) {
    const double sd = before ? before->sd_n : kNotMeasured;
    const double drift = before && after ? after->mean_n - before->mean_n : 0;
    return {ZeroOfLog::Source::tare_rows, table.tare_n,
            std::hypot(sd / std::sqrt(static_cast<double>(selection.tare_rows)), drift / std::sqrt(3.0))};
  }
  if (selection.tared) return {};
  if (before && !before->scatters(largest)) {
    const double drift = after ? after->mean_n - before->mean_n : 0;
    const double u = std::hypot(before->sd_n / std::sqrt(static_cast<double>(before->rows)), drift / std::sqrt(12.0));
    if (std::abs(before->mean_n) > std::max(5e-3 * largest, 3 * before->u_mean()))
      return tied_zero(before->mean_n + drift / 2, u, table);
    return {};
  }
  return fitted_zero(some_points(table), rows >= kRowsOfASeries);
}

std::vector<LogFinding> findings_of(const ZeroOfLog& zero, const ImportedTable& table) {
  if (zero.source != ZeroOfLog::Source::fitted && zero.source != ZeroOfLog::Source::unknown) return {};
  double low = INFINITY, high = 0, largest = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    low = std::min(low, table.speed_rad_s(i)), high = std::max(high, table.speed_rad_s(i));
    largest = std::max(largest, std::abs(table.thrust_n(i)));
  }
  if (zero.source == ZeroOfLog::Source::fitted) {
    return {
        {FindingKind::zero_fitted,
         table.size(),
         0,
         fmt::format("thrust over ω² begins at {:.3f} N, {:.0f} % of the largest thrust, and not at 0: never tared; "
                     "this offset is subtracted, and the ± of k holds it",
                     zero.zero_n, 100 * std::abs(zero.zero_n) / largest),
         {}}};
  }
  return {
      {FindingKind::zero_unknown,
       table.size(),
       0,
       fmt::format(
           "too few rows with the motor off, or none, and {:.0f} to {:.0f} RPM do not tell a zero of {:.2g} N from a k "
           "{:.0f} % off; log it with the motor off first, or say --tared if the stand was tared",
           to_rpm(RadPerSec(low)), to_rpm(RadPerSec(high)), zero.u_n,
           std::min(999.0, 100 * zero.u_n * k_per_zero(table) / typical_k_of(table, zero.zero_n))),
       {}}};
}

}  // namespace kphi::fit
