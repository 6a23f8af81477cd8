#include "fit/logs/series_audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kPlateauRows = 100;
constexpr std::size_t kFrozenRows = 20;
constexpr double kDrift = 0.05;

double local_k(const StandRow& row, SpeedSource source) {
  const double speed = from_rpm(*rpm_of(row, source)).value();
  return row.thrust_n / (speed * speed);
}

void audit_time(const StandLog& log, std::vector<Finding>& findings) {
  Finding backward{.kind = FindingKind::time_backward}, repeated{.kind = FindingKind::time_repeated};
  double largest = 0;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    const auto before = log.rows[i - 1].time_s, now = log.rows[i].time_s;
    if (!before || !now || *now > *before) continue;
    if (*now == *before) count(repeated, log.rows[i]);
    if (*now < *before) count(backward, log.rows[i]);
    largest = std::max(largest, *before - *now);
  }
  backward.text = fmt::format("time goes back, by up to {:.3f} s; the rows keep the order of the file", largest);
  repeated.text = "time stamps stand twice";
  append_if_any(findings, std::move(backward));
  append_if_any(findings, std::move(repeated));
}

void audit_frozen(const StandLog& log, std::vector<Finding>& findings) {
  Finding frozen{.kind = FindingKind::thrust_frozen, .spoils = true};
  for (std::size_t begin = 0, end = 0; begin < log.rows.size(); begin = end) {
    while (end < log.rows.size() && log.rows[end].thrust_n == log.rows[begin].thrust_n) ++end;
    if (end - begin < kFrozenRows || log.rows[begin].thrust_n == 0) continue;
    for (std::size_t i = begin; i < end; ++i) count(frozen, log.rows[i]);
  }
  frozen.text = "the same thrust, bit for bit, row after row: the channel is frozen; such rows are flagged";
  append_if_any(findings, std::move(frozen));
}

void audit_drift(const StandLog& log, SpeedSource source, const std::vector<std::size_t>& rows,
                 std::vector<Finding>& findings) {
  const std::size_t tenth = rows.size() / 10;
  double first = 0, last = 0;
  for (std::size_t i = 0; i < tenth; ++i) {
    first += local_k(log.rows[rows[i]], source) / static_cast<double>(tenth);
    last += local_k(log.rows[rows[rows.size() - 1 - i]], source) / static_cast<double>(tenth);
  }
  if (!(std::abs(last / first - 1) > kDrift)) return;
  Finding finding{.kind = FindingKind::thrust_drifts, .rows = rows.size(), .first_line = log.rows[rows.front()].line};
  finding.text = fmt::format(
      "at constant speed T/ω² goes from {:.3g} to {:.3g} N/(rad/s)² ({:.2f} of it): a k of the whole log means nothing",
      first, last, last / first);
  findings.push_back(std::move(finding));
}

void audit_noise(const StandLog& log, SpeedSource source, const std::vector<std::size_t>& rows,
                 std::vector<Finding>& findings) {
  std::vector<double> longest, stretch;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (i > 0 && rows[i] != rows[i - 1] + 1) stretch.clear();
    stretch.push_back(local_k(log.rows[rows[i]], source));
    if (stretch.size() > longest.size()) longest = stretch;
  }
  if (longest.size() < kPlateauRows) return;
  const double time = correlation_time(longest);
  if (time < 2) return;
  const double n = static_cast<double>(longest.size());
  Finding finding{.kind = FindingKind::correlated_noise, .rows = longest.size()};
  finding.text =
      fmt::format("{} rows at constant speed are worth {:.0f} independent ones: s/√n understates the error {:.1f}-fold",
                  longest.size(), n / time, std::sqrt(time));
  findings.push_back(std::move(finding));
}

}  // namespace

std::vector<std::size_t> plateau(const StandLog& log, SpeedSource source) {
  std::vector<double> speeds;
  for (const StandRow& row : log.rows)
    if (rpm_of(row, source).value_or(0) > 500) speeds.push_back(*rpm_of(row, source));
  std::sort(speeds.begin(), speeds.end());
  constexpr double kWide = 1.02 / 0.98;
  std::size_t most = 0, best = 0;
  for (std::size_t low = 0, high = 0; low < speeds.size(); ++low) {
    while (high < speeds.size() && speeds[high] <= kWide * speeds[low]) ++high;
    if (high - low > most) {
      most = high - low;
      best = low;
    }
  }
  std::vector<std::size_t> rows;
  if (most < kPlateauRows || most * 10 < speeds.size()) return rows;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const double rpm = rpm_of(log.rows[i], source).value_or(0);
    if (rpm >= speeds[best] && rpm <= kWide * speeds[best]) rows.push_back(i);
  }
  return rows;
}

double correlation_time(const std::vector<double>& values) {
  const std::size_t n = values.size();
  double mean = 0, variance = 0;
  for (const double value : values) mean += value / static_cast<double>(n);
  for (const double value : values) variance += (value - mean) * (value - mean);
  if (!(variance > 0)) return 1;
  double time = 1;
  for (std::size_t lag = 1; lag < n / 2; ++lag) {
    double sum = 0;
    for (std::size_t i = lag; i < n; ++i) sum += (values[i] - mean) * (values[i - lag] - mean);
    const double correlation = sum / variance;
    if (correlation < 0.05) break;
    time += 2 * correlation;
  }
  return time;
}

std::vector<Finding> audit_series(const StandLog& log, SpeedSource source) {
  std::vector<Finding> findings;
  audit_time(log, findings);
  audit_frozen(log, findings);
  const std::vector<std::size_t> rows = plateau(log, source);
  if (rows.empty()) return findings;
  audit_drift(log, source, rows, findings);
  audit_noise(log, source, rows, findings);
  return findings;
}

}  // namespace kphi::fit
