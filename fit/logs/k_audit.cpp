#include "fit/logs/k_audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "fit/logs/row_groups.hpp"

namespace kphi::fit {
namespace {

using results::QualityFlag;

constexpr double kStrong = 0.1;          // of the largest thrust: below, T/ω² is noise
constexpr std::size_t kEnough = 20'000;  // rows to judge by
constexpr double kMisfit = 0.10;         // residual over the largest thrust
constexpr double kUnknown95 = 0.5;       // ± over k

double strongest(const ImportedTable& table) {
  double most = 0;
  for (std::size_t i = 0; i < table.size(); ++i) most = std::max(most, table.thrust_n(i));
  return most;
}

double typical_k(const ImportedTable& table, double strong_n) {
  std::vector<double> k;
  const std::size_t every = table.size() / kEnough + 1;
  for (std::size_t i = 0; i < table.size(); i += every)
    if (table.thrust_n(i) > strong_n) k.push_back(table.thrust_n(i) / square(table.speed_rad_s(i)));
  return k.size() < 5 ? 0 : median(k);
}

void leave_out(ImportedTable& table, const std::vector<std::size_t>& rows, FindingKind kind, const std::string& text,
               std::vector<LogFinding>& findings) {
  if (rows.empty()) return;
  LogFinding finding{kind, rows.size(), table.rows[rows.front()].line, text, {}};
  table.left_out.resize(table.size());
  for (const std::size_t row : rows) {
    finding.lines.push_back(table.rows[row].line);
    table.quality_flags[row] |= static_cast<std::uint32_t>(QualityFlag::speed_unsteady);
    table.left_out[row] = true;
  }
  findings.push_back(std::move(finding));
}

/// Speed over what the thrust of the row needs is 2 or 1/2.
void audit_doubled(ImportedTable& table, std::vector<LogFinding>& findings) {
  constexpr double kMost = 0.3, kNear = 0.06, kAsOthers = 0.25;
  const double strong = kStrong * strongest(table), k = typical_k(table, strong);
  if (!(k > 0)) return;
  std::vector<std::size_t> rows;
  std::size_t right = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (!(table.thrust_n(i) > strong)) continue;
    const double ratio = table.speed_rad_s(i) / std::sqrt(table.thrust_n(i) / k);
    if (std::abs(ratio / 2 - 1) < kNear || std::abs(2 * ratio - 1) < kNear) rows.push_back(i);
    right += std::abs(ratio - 1) < kAsOthers ? 1 : 0;
  }
  if (static_cast<double>(rows.size()) > kMost * static_cast<double>(right)) return;
  leave_out(table, rows, FindingKind::speed_doubled,
            "speed is twice or half of what the thrust needs: the counter took two pulses for one, or one for two; "
            "rows left out",
            findings);
}

struct LogPoint {
  double x = 0, y = 0;
  std::size_t row = 0;
};

/// The row furthest from a power law through all others: index, distance and their scatter, in logarithms.
struct Furthest {
  std::size_t index = 0;
  double distance = 0, sd = 0;
};

Furthest furthest(const std::vector<LogPoint>& points) {
  Furthest worst;
  double most = 0;
  for (std::size_t out = 0; out < points.size(); ++out) {
    double n = 0, x = 0, y = 0, sxx = 0, sxy = 0, syy = 0;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (i != out) n += 1, x += points[i].x, y += points[i].y;
    x /= n, y /= n;
    for (std::size_t i = 0; i < points.size(); ++i)
      if (i != out)
        sxx += square(points[i].x - x), sxy += (points[i].x - x) * (points[i].y - y), syy += square(points[i].y - y);
    if (!(sxx > 0)) continue;
    const double slope = sxy / sxx, sd = std::sqrt(std::max(0.0, syy - slope * sxy) / std::max(1.0, n - 2));
    const double distance = points[out].y - y - slope * (points[out].x - x);
    const double u = std::max(sd, 1e-6) * std::sqrt(1 + 1 / n + square(points[out].x - x) / sxx);
    if (std::abs(distance) / u > most) most = std::abs(distance) / u, worst = {out, distance, u};
  }
  return worst;
}

/// A glitch among few rows: thrust or speed of a row far from the curve of all others.
void audit_unlike(ImportedTable& table, std::vector<LogFinding>& findings) {
  constexpr std::size_t kFewest = 6, kFew = 200;
  constexpr double kFar = 8, kShare = 0.10, kMost = 0.2;
  const double strong = kStrong * strongest(table);
  std::vector<LogPoint> points;
  for (std::size_t i = 0; i < table.size() && points.size() <= kFew; ++i)
    if (table.thrust_n(i) > strong && !table.is_left_out(i))
      points.push_back({std::log(table.speed_rad_s(i)), std::log(table.thrust_n(i)), i});
  if (points.size() < kFewest || points.size() > kFew) return;
  std::vector<std::size_t> rows;
  double worst = 0;
  for (auto most = static_cast<std::size_t>(kMost * static_cast<double>(points.size())); most > 0; --most) {
    const Furthest one = furthest(points);
    if (std::abs(one.distance) < kFar * one.sd || std::abs(one.distance) < kShare) break;
    if (std::abs(one.distance) > std::abs(worst)) worst = one.distance;
    rows.push_back(points[one.index].row);
    points.erase(points.begin() + static_cast<std::ptrdiff_t>(one.index));
  }
  std::ranges::sort(rows);
  leave_out(
      table, rows, FindingKind::row_unlike,
      fmt::format("thrust is up to {:+.0f} % off the curve of all other rows, far beyond their scatter: a glitch of "
                  "speed or thrust; rows left out",
                  100 * std::expm1(worst)),
      findings);
}

/// Half a step of the speed, in rad/s, moves k by this share.
double share_of_step(const ImportedTable& table, double half_step) {
  double third = 0, fourth = 0;
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double speed = table.speed_rad_s(i);
    third += speed * speed * speed, fourth += square(speed * speed);
  }
  return 2 * half_step * third / fourth;
}

OcclusionFit fit_of(double occlusion_deg, std::vector<Point> points, const ImportedTable& table, double step_share) {
  OcclusionFit one{occlusion_deg, fit_thrust(std::move(points)), 0};
  const double zero = std::isnan(table.zero_u_n) ? 0 : table.zero_u_n * k_per_zero(table);
  one.u_k = std::hypot(one.fit.standard_error.k, zero, step_share * one.fit.parameters.k);
  return one;
}

void judge(const OcclusionFit& one, const ImportedTable& table, std::vector<LogFinding>& findings) {
  const double k = one.fit.parameters.k;
  const std::string where = one.occlusion_deg == 0 ? "" : fmt::format("at {:g}°: ", one.occlusion_deg);
  double most = 0;
  for (const Point& point : one.fit.points) most = std::max(most, std::abs(point.thrust_n));
  const auto spoil = [&](const std::string& text) {
    findings.push_back({FindingKind::one_k_misfits, one.fit.n, 0, where + text, {}});
  };
  if (!(k > 0)) {
    spoil(fmt::format("k is {:.3g} N/(rad/s)²: thrust does not grow with speed", k));
  } else if (one.fit.rms_n > kMisfit * most) {
    spoil(fmt::format(
        "rows lie {:.3g} N about T = k ω², {:.0f} % of the largest thrust: one k does not describe them; "
        "if they are of several things, name the column that tells: --column propeller=HEADER, motor or direction",
        one.fit.rms_n, 100 * one.fit.rms_n / most));
  } else if (2 * one.u_k > kUnknown95 * k) {
    spoil(fmt::format("k is known to ± {:.0f} % only (95 %)", 200 * one.u_k / k));
  }
  if (table.size() == one.fit.n)
    if (const auto levels = two_levels(table))
      spoil(levels->words() + ": two things, or a setting that changed between them; import them apart");
}

}  // namespace

double speed_step_rpm(const ImportedTable& table) {
  constexpr std::size_t kFewestRows = 50, kFewestLevels = 4;
  constexpr double kFinest = 3e-3;  // of the speed: finer steps cost less than 0.3 % of k
  if (table.size() < kFewestRows) return 0;
  std::map<double, std::vector<double>> levels;  // thrust by speed
  const std::size_t every = table.size() / kEnough + 1;
  double highest = 0;
  for (std::size_t i = 0; i < table.size(); i += every) {
    const double rpm = to_rpm(RadPerSec(table.speed_rad_s(i)));
    levels[std::round(100 * rpm) / 100].push_back(table.thrust_n(i));
    highest = std::max(highest, rpm);
    if (levels.size() > 2000) return 0;
  }
  if (levels.size() < kFewestLevels) return 0;
  double step = INFINITY;
  for (auto one = levels.begin(), next = std::next(one); next != levels.end(); ++one, ++next)
    step = std::min(step, next->first - one->first);
  if (step < kFinest * highest) return 0;
  const double first = levels.begin()->first;
  for (const auto& [rpm, thrusts] : levels)
    if (std::abs(std::remainder(rpm - first, step)) > 0.02 * step) return 0;
  // Set speeds are round numbers, too; but there the thrust is that of the number and not of all speeds around it.
  double seen = 0, expected = 0;
  const double strong = kStrong * strongest(table), k = typical_k(table, strong);
  for (const auto& [rpm, thrusts] : levels) {
    if (thrusts.size() < 3 || median(thrusts) < strong) continue;
    seen += std::sqrt(variance(thrusts)) * static_cast<double>(thrusts.size());
    expected +=
        2 * k * from_rpm(rpm).value() * from_rpm(step).value() / std::sqrt(12.0) * static_cast<double>(thrusts.size());
  }
  return expected > 0 && seen > 0.4 * expected ? step : 0;
}

std::vector<LogFinding> audit_rows(ImportedTable& table) {
  std::vector<LogFinding> findings;
  audit_doubled(table, findings);
  audit_unlike(table, findings);
  return findings;
}

void leave_out_obvious(ImportedTable& table) {
  const std::vector<std::uint32_t> flags = table.quality_flags;
  std::vector<bool> left_out = table.left_out;
  const double all = 1 - line_through(some_points(table)).correlation;
  if (audit_rows(table).empty()) return;
  const double kept = 1 - line_through(some_points(table)).correlation;
  table.quality_flags = flags;
  if (!(2 * kept < all)) table.left_out = std::move(left_out);
}

JudgedFit judged_fit(const ImportedTable& table) {
  JudgedFit judged;
  judged.throttle = throttle_laws(table);
  const double step = speed_step_rpm(table);
  const double share = step > 0 ? share_of_step(table, from_rpm(step / 2).value()) : 0;
  judged.u_speed = share / 2;
  if (step > 0) {
    judged.findings.push_back(
        {FindingKind::speed_stepped,
         table.size(),
         0,
         fmt::format("the speed comes in steps of {:.4g} RPM, as of a counter of few pulses: a step too low or high is "
                     "{:.1f} % of k, half of it is in its ±; k is too high where the counter cuts off",
                     step, 200 * share),
         {}});
  }
  std::map<double, std::vector<Point>> points;
  for (std::size_t i = 0; i < table.size(); ++i) {
    if (table.is_left_out(i)) continue;
    std::vector<Point>& its = points[table.rows[i].occlusion_deg.value_or(0)];
    if (its.empty() && points.size() == 1) its.reserve(table.size());
    its.push_back({table.speed_rad_s(i), table.thrust_n(i)});
  }
  for (auto& [occlusion, its] : points) judged.fits.push_back(fit_of(occlusion, std::move(its), table, share));
  for (const OcclusionFit& one : judged.fits) judge(one, table, judged.findings);
  return judged;
}

}  // namespace kphi::fit
