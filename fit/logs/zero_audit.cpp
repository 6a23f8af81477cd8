#include "fit/logs/zero_audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/logs/row_selection.hpp"

namespace kphi::fit {
namespace {

constexpr std::size_t kRowsForAZero = 10;
constexpr std::size_t kRowsOfASeries = 50;

template <class Rows>
std::optional<LogZero> leading_zero(const Rows& rows, SpeedSource source) {
  std::vector<double> values;
  for (const StandRow& row : rows) {
    if (rpm_of(row, source).value_or(0) > 0) break;
    if (motor_off(row, source)) values.push_back(row.thrust_n);
  }
  if (values.size() < kRowsForAZero) return std::nullopt;
  LogZero zero;
  zero.rows = values.size();
  const double n = static_cast<double>(values.size());
  for (const double value : values) zero.mean_n += value / n;
  for (const double value : values) zero.sd_n += (value - zero.mean_n) * (value - zero.mean_n) / (n - 1);
  zero.sd_n = std::sqrt(zero.sd_n);
  return zero;
}

std::string words(const char* when, const LogZero& zero) {
  return fmt::format("{:.3f} N {} ({} rows, sd {:.3f} N)", zero.mean_n, when, zero.rows, zero.sd_n);
}

Finding of_file(FindingKind kind, std::size_t rows, std::string text) {
  Finding finding{.kind = kind, .rows = rows};
  finding.text = std::move(text);
  return finding;
}

void judge_before(const LogZero& zero, double largest, double tare_n, std::vector<Finding>& findings) {
  if (zero.sd_n > kTareScatterMax * largest) {
    findings.push_back(of_file(FindingKind::zero_scatters, zero.rows,
                               "the still motor reads " + words("before", zero) + ": no zero can be taken there"));
  } else if (tare_n == 0 && std::abs(zero.mean_n) > std::max(5e-3 * largest, 3 * zero.sd_n)) {
    findings.push_back(of_file(FindingKind::untared, zero.rows,
                               fmt::format("the still motor reads {}, {:.1f} % of the largest thrust: never tared; "
                                           "import with --tare-rows {}",
                                           words("before", zero), 100 * std::abs(zero.mean_n) / largest,
                                           std::min<std::size_t>(zero.rows, 100))));
  }
}

void judge_drift(const LogZero& before, const LogZero& after, double largest, std::vector<Finding>& findings) {
  const double drift = after.mean_n - before.mean_n;
  if (std::abs(drift) <= std::max(1e-3 * largest, 5 * std::hypot(before.sd_n, after.sd_n))) return;
  findings.push_back(of_file(
      FindingKind::zero_drifted, before.rows + after.rows,
      fmt::format("the zero moved by {:+.3f} N: {}, {}", drift, words("before", before), words("after", after))));
}

}  // namespace

std::optional<LogZero> zero_before(const StandLog& log, SpeedSource source) { return leading_zero(log.rows, source); }

std::optional<LogZero> zero_after(const StandLog& log, SpeedSource source) {
  return leading_zero(std::vector<StandRow>(log.rows.rbegin(), log.rows.rend()), source);
}

std::vector<Finding> audit_zero(const StandLog& log, SpeedSource source, double tare_n) {
  std::vector<Finding> findings;
  const double largest = largest_thrust(log);
  const auto before = zero_before(log, source), after = zero_after(log, source);
  if (before) judge_before(*before, largest, tare_n, findings);
  if (before && after) judge_drift(*before, *after, largest, findings);
  if (!before && log.rows.size() >= kRowsOfASeries) {
    findings.push_back(of_file(FindingKind::zero_missing, log.rows.size(),
                               "no rows of a still motor before it turns: the zero is not known, and k may be off by "
                               "some percent"));
  }
  Finding negative{.kind = FindingKind::negative_thrust};
  double lowest = 0;
  for (const StandRow& row : log.rows) {
    if (!(row.thrust_n < 0)) continue;
    count(negative, row);
    lowest = std::min(lowest, row.thrust_n);
  }
  negative.text = fmt::format("thrust below 0, down to {:.4f} N", lowest);
  append_if_any(findings, std::move(negative));
  return findings;
}

}  // namespace kphi::fit
