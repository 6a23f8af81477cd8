#include "fit/logs/log_audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/statistics.hpp"
#include "fit/logs/series_audit.hpp"
#include "fit/logs/speed_audit.hpp"
#include "fit/logs/zero_audit.hpp"

namespace kphi::fit {
namespace {

using results::QualityFlag;

void append(std::vector<Finding>& all, std::vector<Finding> more) {
  all.insert(all.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

Finding other_fields(const StandLog& log) {
  Finding finding{.kind = FindingKind::other_fields};
  for (const TableProblem& problem : log.problems) count(finding, {.line = problem.line});
  if (!log.problems.empty()) finding.text = "lines left out; the first: " + log.problems.front().what;
  return finding;
}

QualityFlag flag_of(FindingKind kind) {
  return kind == FindingKind::thrust_frozen ? QualityFlag::bad_status : QualityFlag::speed_unsteady;
}

}  // namespace

std::vector<Finding> audit(const StandLog& log, const RowSelection& selection) {
  const SpeedSource source = choose_speed(log, selection);
  const auto zero = zero_before(log, source);
  std::vector<Finding> findings = compare_speeds(log).findings;
  append(findings, audit_speed(log, source, zero ? zero->mean_n : 0));
  append(findings, audit_zero(log, source, selection.tare_rows > 0 ? zero.value_or(LogZero{}).mean_n : 0));
  append(findings, audit_series(log, source));
  append_if_any(findings, other_fields(log));
  return findings;
}

void flag_steps(ImportedTable& table, const std::vector<Finding>& findings) {
  for (const Finding& finding : findings) {
    const bool limit = finding.kind == FindingKind::current_limit;
    if (!finding.spoils && !limit) continue;
    const auto flag = static_cast<std::uint32_t>(limit ? QualityFlag::supply_out_of_band : flag_of(finding.kind));
    const std::set<std::size_t> lines(finding.lines.begin(), finding.lines.end());
    for (std::size_t i = 0; i < table.steps.size(); ++i)
      if (lines.contains(table.lines[i])) table.steps[i].quality_flags |= flag;
  }
}

std::vector<GroupOutlier> group_outliers(std::span<const NamedCoefficient> group) {
  constexpr std::size_t kFewest = 5;
  constexpr double kRobustDeviations = 4, kShare = 0.05;
  std::vector<GroupOutlier> outliers;
  if (group.size() < kFewest) return outliers;
  std::vector<double> values, deviations;
  for (const NamedCoefficient& entry : group) values.push_back(entry.k);
  const double middle = median(values);
  for (const double value : values) deviations.push_back(std::abs(value / middle - 1));
  const double robust_sd = 1.4826 * median(deviations);
  for (const NamedCoefficient& entry : group) {
    const double share = entry.k / middle - 1;
    if (std::abs(share) > std::max(kShare, kRobustDeviations * robust_sd))
      outliers.push_back({entry.name, share, robust_sd});
  }
  return outliers;
}

}  // namespace kphi::fit
