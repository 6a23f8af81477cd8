#include "fit/logs/stand_log.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace kphi::fit {

bool motor_off(const StandRow& row, SpeedSource source) {
  return row.throttle_us && *row.throttle_us <= kIdleUs && rpm_of(row, source).value_or(0) == 0;
}

double largest_thrust(const StandLog& log) {
  double largest = 0;
  for (const StandRow& row : log.rows) largest = std::max(largest, std::abs(row.thrust_n));
  return largest;
}

const char* name_of(FindingKind kind) {
  static constexpr std::array kNames{
      "speed_ratio",   "speed_disagrees", "speed_dead",        "speed_spike",   "speed_missing",    "barely_turning",
      "not_turning",   "coasting",        "current_limit",     "untared",       "zero_missing",     "zero_drifted",
      "zero_scatters", "negative_thrust", "thrust_frozen",     "thrust_drifts", "correlated_noise", "time_backward",
      "time_repeated", "other_fields",    "k_unlike_its_group"};
  return kNames[static_cast<std::size_t>(kind)];
}

void count(Finding& finding, const StandRow& row) {
  if (finding.rows++ == 0) finding.first_line = row.line;
  finding.lines.push_back(row.line);
}

void append_if_any(std::vector<Finding>& findings, Finding finding) {
  if (finding.rows > 0) findings.push_back(std::move(finding));
}

}  // namespace kphi::fit
