#include "fit/logs/log_audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <future>
#include <iterator>
#include <numeric>
#include <utility>

#include "base/ordered_work.hpp"
#include "base/statistics.hpp"
#include "compensation/units.hpp"
#include "fit/logs/thrust_slope.hpp"

namespace kphi::fit {
namespace {

using results::QualityFlag;
using Findings = std::vector<LogFinding>;
using Rows = std::vector<const StandRow*>;

constexpr std::array kNames{"speed_ratio",    "speed_disagrees",    "speed_dead",    "speed_spike",     "speed_missing",
                            "barely_turning", "not_turning",        "coasting",      "current_limit",   "untared",
                            "zero_missing",   "zero_drifted",       "zero_scatters", "negative_thrust", "thrust_frozen",
                            "thrust_drifts",  "correlated_noise",   "time_backward", "time_repeated",   "not_a_number",
                            "other_fields",   "k_unlike_its_group", "speed_frozen",  "speed_doubled",   "row_unlike",
                            "speed_stepped",  "zero_fitted",        "zero_unknown",  "several_groups",  "one_k_misfits",
                            "speed_too_low"};
static_assert(kNames.size() == static_cast<std::size_t>(FindingKind::speed_too_low) + 1);

/// Of the steps concerned.
QualityFlag flag_of(FindingKind kind) {
  using enum FindingKind;
  if (kind == speed_disagrees || kind == speed_dead || kind == speed_spike) return QualityFlag::speed_unsteady;
  if (kind == speed_frozen) return QualityFlag::frozen;
  if (kind == current_limit) return QualityFlag::supply_out_of_band;
  return kind == thrust_frozen ? QualityFlag::bad_status : QualityFlag::none;
}

/// Adds a finding about the whole log or one stretch of it.
void add(Findings& findings, FindingKind kind, std::size_t rows, std::size_t first_line, std::string text) {
  findings.push_back({kind, rows, first_line, std::move(text), {}});
}

/// Adds a finding about these rows; none if there are none.
void add(Findings& findings, FindingKind kind, const Rows& rows, std::string text) {
  if (rows.empty()) return;
  add(findings, kind, rows.size(), rows.front()->line, std::move(text));
  for (const StandRow* row : rows) findings.back().lines.push_back(row->line);
}

template <class Concerned>
Rows rows_where(const StandLog& log, Concerned concerned) {
  Rows rows;
  for (const StandRow& row : log.rows)
    if (concerned(row)) rows.push_back(&row);
  return rows;
}

// ---- speeds ------------------------------------------------------------------------------------------------

constexpr double kTurningRpm = 100;
constexpr double kThrustThere = from_gram_force(5).value();

bool both_turn(const StandRow& row) {
  return row.electrical_rpm.value_or(0) > kTurningRpm && row.optical_rpm.value_or(0) > kTurningRpm;
}

/// optical/electrical of the rows in which both turn and neither stands still while the other changes.
std::vector<double> live_ratios(const StandLog& log) {
  std::vector<double> ratios;
  const StandRow* before = nullptr;
  for (const StandRow& row : log.rows) {
    const StandRow* const last = std::exchange(before, &row);
    if (!both_turn(row)) continue;
    const bool same_e = last != nullptr && last->electrical_rpm == *row.electrical_rpm,
               same_o = last != nullptr && last->optical_rpm == *row.optical_rpm;
    if (same_e == same_o) ratios.push_back(*row.optical_rpm / *row.electrical_rpm);
  }
  return ratios;
}

void judge_ratio(double ratio, std::size_t rows, Findings& findings) {
  if (std::abs(ratio - 1) < 0.01) return;
  std::string text = fmt::format(
      "optical/electrical speed is {:.4f}, which is not a ratio of pole counts: one speed is wrong; name "
      "the right one with --speed",
      ratio);
  if (const auto poles = pole_ratio(ratio)) {
    // Electrical speed is the commutation frequency divided by the pole pairs that were set.
    text = fmt::format(
        "optical/electrical speed is {0:.4f} = {1}/{2}, as if {3} poles were set for a motor of {4}; use --speed "
        "optical, or --speed electrical --speed-factor {1}/{2}",
        ratio, poles->numerator, poles->denominator, 2 * poles->numerator, 2 * poles->denominator);
  }
  add(findings, FindingKind::speed_ratio, rows, 0, std::move(text));
}

void audit_two_speeds(const StandLog& log, Findings& findings) {
  std::vector<double> ratios = live_ratios(log), off;
  if (ratios.size() < 3) return;
  const double ratio = upper_median(ratios);
  judge_ratio(ratio, ratios.size(), findings);
  for (const double one : ratios) off.push_back(std::abs(one / ratio - 1));
  // Two counters read one after the other never agree to the last digit.
  const double tolerance = std::max(3e-3, 6 * 1.4826 * upper_median(off));
  Rows disagree, dead;
  double worst = 0;
  for (const StandRow& row : log.rows) {
    const double electrical = row.electrical_rpm.value_or(0) * ratio, optical = row.optical_rpm.value_or(0);
    if (std::max(electrical, optical) <= 10 * kTurningRpm) continue;
    if (std::min(electrical, optical) / std::max(electrical, optical) < 0.2) {
      dead.push_back(&row);
    } else if (std::abs(optical / electrical - 1) > tolerance) {
      disagree.push_back(&row);
      if (std::abs(optical / electrical - 1) > std::abs(worst)) worst = optical / electrical - 1;
    }
  }
  add(findings, FindingKind::speed_disagrees, disagree,
      fmt::format("the two speeds differ by up to {:+.1f} % from their usual ratio; rows flagged", 100 * worst));
  add(findings, FindingKind::speed_dead, dead, "one speed sensor reads 0 while the other turns; rows flagged");
}

/// Above twice the target, or half as much again as the rows around it.
void audit_spikes(const StandLog& log, SpeedSource source, Findings& findings) {
  constexpr std::size_t kAround = 2;
  constexpr double kHigher = 1.5;
  const auto at = [&](std::size_t i) { return rpm_of(log.rows[i], source).value_or(0); };
  const bool series = log.rows.size() >= 50;
  double highest = 0;
  Rows spikes;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const double target = log.rows[i].target_rpm.value_or(0);
    bool spike = target > 0 && at(i) > 2 * target;
    if (target <= 0 && series && i >= kAround && i + kAround < log.rows.size()) {
      if (!(at(i) > kHigher * std::min({at(i - 2), at(i - 1), at(i + 1), at(i + 2)}))) continue;
      const double around = upper_median({at(i - 2), at(i - 1), at(i + 1), at(i + 2)});
      spike = around > kTurningRpm && at(i) > kHigher * around;
    }
    if (!spike) continue;
    spikes.push_back(&log.rows[i]);
    highest = std::max(highest, at(i));
  }
  add(findings, FindingKind::speed_spike, spikes, fmt::format("speed spikes, up to {:.0f} RPM; rows flagged", highest));
}

/// `zero_n`: thrust with the motor off.
void audit_standstill(const StandLog& log, SpeedSource source, double zero_n, Findings& findings) {
  Rows missing, barely, still, coasting;
  bool turned = false;
  for (const StandRow& row : log.rows) {
    const auto rpm = rpm_of(row, source);
    if (!rpm) continue;
    const bool idle = row.throttle_us && *row.throttle_us <= kIdleUs;
    if (idle && (*rpm >= kTurningRpm || (*rpm > 0 && turned))) {
      coasting.push_back(&row);
    } else if (*rpm > 0 && *rpm < kTurningRpm) {
      barely.push_back(&row);
    }
    turned = turned || *rpm >= kTurningRpm;
    if (!idle && *rpm == 0) (row.thrust_n - zero_n > kThrustThere ? missing : still).push_back(&row);
  }
  add(findings, FindingKind::speed_missing, missing,
      "speed reads 0 while there is thrust: the sensor does not see the propeller; rows skipped");
  if (turned)
    add(findings, FindingKind::barely_turning, barely,
        "speed below 100 RPM: such rows hardly count in a fit, but their own T/ω² means nothing");
  else
    add(findings, FindingKind::speed_too_low, barely,
        "no row reaches 100 RPM: the speeds are in another unit, or their mark is one between thousands; say which "
        "with "
        "--column speed=HEADER:UNIT or --decimal comma");
  add(findings, FindingKind::not_turning, still, "the motor does not turn with the throttle above idle; rows skipped");
  add(findings, FindingKind::coasting, coasting,
      "the propeller turns with the throttle idle: such rows cannot give a zero");
}

/// Two neighbouring rows of a rising command between which speed and voltage fall.
void audit_current_limit(const StandLog& log, SpeedSource source, Findings& findings) {
  constexpr double kSpeedFalls = 0.995, kVoltageFalls = 0.97;
  Rows limited;
  double current = 0, lowest = 0;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    const StandRow &before = log.rows[i - 1], &row = log.rows[i];
    const double speed = rpm_of(row, source).value_or(0), speed_before = rpm_of(before, source).value_or(0);
    if (!row.throttle_us || !before.throttle_us || !row.voltage_v || !before.voltage_v) continue;
    if (*row.throttle_us - *before.throttle_us < 20 || speed_before < 10 * kTurningRpm) continue;
    if (speed > kSpeedFalls * speed_before || *row.voltage_v > kVoltageFalls * *before.voltage_v) continue;
    lowest = limited.empty() ? *row.voltage_v : std::min(lowest, *row.voltage_v);
    limited.push_back(&row);
    current = std::max(current, row.current_a.value_or(0));
  }
  add(findings, FindingKind::current_limit, limited,
      fmt::format(
          "the supply is at its current limit ({:.2f} A): the command rises, but voltage (down to {:.2f} V) and "
          "speed fall; the commanded speed was not reached",
          current, lowest));
}

// ---- zero --------------------------------------------------------------------------------------------------

/// So far off the mean is a row of noise alone in one of 1,000 logs of so many rows (Bonferroni).
double furthest_by_chance(const RestRows& rest, std::size_t rows) {
  const boost::math::students_t distribution(static_cast<double>(rest.rows - 1));
  return rest.sd_n * boost::math::quantile(complement(distribution, 1e-3 / static_cast<double>(rows)));
}

/// `tare_n` is what the import subtracts.
void audit_zero(const StandLog& log, const std::optional<RestRows>& before, const std::optional<RestRows>& after,
                double tare_n, Findings& findings) {
  const double largest = largest_thrust(log);
  if (before && before->scatters(largest)) {
    add(findings, FindingKind::zero_scatters, before->rows, 0,
        "with the motor off the stand reads " + before->words("before") + ": too noisy for a zero");
  } else if (before && tare_n == 0 && std::abs(before->mean_n) > std::max(5e-3 * largest, 3 * before->u_mean())) {
    add(findings, FindingKind::untared, before->rows, 0,
        fmt::format("with the motor off the stand reads {}, {:.1f} % of the largest thrust: never tared; what it reads "
                    "with the motor off is subtracted",
                    before->words("before"), 100 * std::abs(before->mean_n) / largest));
  }
  const double drift = before && after ? after->mean_n - before->mean_n : 0;
  if (before && after && std::abs(drift) > std::max(1e-3 * largest, 5 * std::hypot(before->sd_n, after->sd_n))) {
    add(findings, FindingKind::zero_drifted, before->rows + after->rows, 0,
        fmt::format("the zero moved by {:+.3f} N: {}, {}", drift, before->words("before"), after->words("after")));
  }
  if (!before && log.rows.size() >= kRowsOfASeries) {
    add(findings, FindingKind::zero_missing, log.rows.size(), 0,
        "no rows with the motor off at the beginning tell the zero");
  }
  const double noise = std::max(5e-3 * largest, before ? furthest_by_chance(*before, log.rows.size()) : 0);
  double lowest = 0;
  for (const StandRow& row : log.rows) lowest = std::min(lowest, row.thrust_n);
  add(findings, FindingKind::negative_thrust,
      rows_where(log, [&](const StandRow& row) { return row.thrust_n < -noise; }),
      fmt::format("thrust below 0 by more than noise, down to {:.4f} N", lowest));
}

// ---- time series -------------------------------------------------------------------------------------------

constexpr std::size_t kPlateauRows = 100;

double local_k(const StandRow& row, SpeedSource source) {
  const double speed = from_rpm(*rpm_of(row, source)).value();
  return row.thrust_n / (speed * speed);
}

void audit_time(const StandLog& log, Findings& findings) {
  Rows backward, repeated;
  double largest = 0;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    const auto before = log.rows[i - 1].time_s, now = log.rows[i].time_s;
    if (!before || !now || *now > *before) continue;
    if (*now == *before) repeated.push_back(&log.rows[i]);
    if (*now < *before) backward.push_back(&log.rows[i]);
    largest = std::max(largest, *before - *now);
  }
  add(findings, FindingKind::time_backward, backward,
      fmt::format("time goes back, by up to {:.3f} s; the rows keep the order of the file", largest));
  add(findings, FindingKind::time_repeated, repeated, "time stamps occur twice");
}

constexpr std::size_t kFrozenRows = 20;

/// The same speed above 0 row after row while the thrust changes by a tenth of the largest and more.
void audit_frozen_speed(const StandLog& log, SpeedSource source, Findings& findings) {
  constexpr double kChanges = 0.1;
  const double largest = largest_thrust(log);
  const auto rpm = [&](std::size_t i) { return rpm_of(log.rows[i], source).value_or(0); };
  Rows frozen;
  for (std::size_t begin = 0, end = 0; begin < log.rows.size(); begin = end) {
    double low = log.rows[begin].thrust_n, high = low;
    for (; end < log.rows.size() && rpm(end) == rpm(begin); ++end)
      low = std::min(low, log.rows[end].thrust_n), high = std::max(high, log.rows[end].thrust_n);
    if (end - begin < kFrozenRows || rpm(begin) <= 0 || high - low < kChanges * largest ||
        end - begin == log.rows.size())
      continue;
    for (std::size_t i = begin; i < end; ++i) frozen.push_back(&log.rows[i]);
  }
  add(findings, FindingKind::speed_frozen, frozen,
      "the same speed row after row while the thrust changes: the channel is frozen; rows left out");
}

void audit_frozen(const StandLog& log, Findings& findings) {
  Rows frozen;
  for (std::size_t begin = 0, end = 0; begin < log.rows.size(); begin = end) {
    while (end < log.rows.size() && log.rows[end].thrust_n == log.rows[begin].thrust_n) ++end;
    if (end - begin < kFrozenRows || log.rows[begin].thrust_n == 0) continue;
    for (std::size_t i = begin; i < end; ++i) frozen.push_back(&log.rows[i]);
  }
  add(findings, FindingKind::thrust_frozen, frozen,
      "the same thrust, bit for bit, row after row: the channel is frozen; rows flagged");
}

/// The rows within 2 % of the speed at which the log stays longest: indexes into log.rows. Empty with fewer than 100 of
/// them, or under a tenth of the rows that turn.
std::vector<std::size_t> plateau(const StandLog& log, SpeedSource source) {
  constexpr double kSlowest = 500, kParts = 1000;  // one in kParts of the speed is a class
  constexpr std::ptrdiff_t kClasses = 40;          // as wide as ± 2 %
  const auto class_of = [&](const StandRow& row) {
    const double rpm = rpm_of(row, source).value_or(0);
    return rpm > kSlowest ? static_cast<std::ptrdiff_t>(kParts * std::log(rpm / kSlowest)) : -1;
  };
  std::vector<std::size_t> counts(kClasses);
  std::size_t turning = 0;
  for (const StandRow& row : log.rows) {
    const std::ptrdiff_t one = class_of(row);
    if (one < 0) continue;
    const auto place = static_cast<std::size_t>(one);
    if (place >= counts.size()) counts.resize(place + 1);
    ++counts[place];
    ++turning;
  }
  std::size_t within = std::accumulate(counts.begin(), counts.begin() + kClasses, std::size_t{0}), most = within;
  std::ptrdiff_t best = 0;
  for (std::ptrdiff_t low = 1; low + kClasses <= std::ssize(counts); ++low) {
    within += counts[static_cast<std::size_t>(low + kClasses - 1)] - counts[static_cast<std::size_t>(low - 1)];
    if (within > most) most = within, best = low;
  }
  std::vector<std::size_t> rows;
  if (most < kPlateauRows || most * 10 < turning) return rows;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const std::ptrdiff_t one = class_of(log.rows[i]);
    if (one >= best && one < best + kClasses) rows.push_back(i);
  }
  return rows;
}

void audit_drift(const StandLog& log, SpeedSource source, const std::vector<std::size_t>& rows, Findings& findings) {
  constexpr double kDrift = 0.05;
  std::vector<double> first, last;
  for (std::size_t i = 0; i < rows.size() / 10; ++i) {
    first.push_back(local_k(log.rows[rows[i]], source));
    last.push_back(local_k(log.rows[rows[rows.size() - 1 - i]], source));
  }
  const double share = mean(last) / mean(first);
  if (!(std::abs(share - 1) > kDrift)) return;
  add(findings, FindingKind::thrust_drifts, rows.size(), log.rows[rows.front()].line,
      fmt::format("at constant speed T/ω² goes from {:.3g} to {:.3g} N/(rad/s)² ({:.2f} times): one k for the whole "
                  "log means nothing",
                  mean(first), mean(last), share));
}

void audit_noise(const StandLog& log, SpeedSource source, const std::vector<std::size_t>& rows, Findings& findings) {
  constexpr std::size_t kEnough = 30'000;  // for its time; each row meets each
  std::size_t first = 0, longest = 0;
  for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
    for (end = begin + 1; end < rows.size() && rows[end] == rows[end - 1] + 1;) ++end;
    if (end - begin > longest) first = begin, longest = end - begin;
  }
  if (longest < kPlateauRows) return;
  std::vector<double> stretch;
  for (std::size_t i = first; i < first + std::min(longest, kEnough); ++i)
    stretch.push_back(local_k(log.rows[rows[i]], source));
  const double time = correlation_time(stretch);
  if (time < 2) return;
  add(findings, FindingKind::correlated_noise, longest, 0,
      fmt::format("{} rows at constant speed count as {:.0f} independent ones: s/√n is {:.1f} times too small", longest,
                  static_cast<double>(longest) / time, std::sqrt(time)));
}

}  // namespace

const char* name_of(FindingKind kind) { return kNames[static_cast<std::size_t>(kind)]; }

bool spoils_k(FindingKind kind) {
  using enum FindingKind;
  return kind == thrust_drifts || kind == zero_unknown || kind == one_k_misfits || kind == speed_too_low;
}

std::optional<PoleRatio> pole_ratio(double ratio) {
  constexpr int kMost = 24;
  constexpr double kTolerance = 2e-3;
  if (!(ratio > 0) || std::abs(ratio - 1) < 0.01) return std::nullopt;
  for (int sum = 3; sum <= 2 * kMost; ++sum) {
    for (int denominator = 1; denominator < sum; ++denominator) {
      const int numerator = sum - denominator;
      if (numerator > kMost || denominator > kMost || std::gcd(numerator, denominator) != 1) continue;
      if (std::abs(ratio * denominator / numerator - 1) < kTolerance) return PoleRatio{numerator, denominator};
    }
  }
  return std::nullopt;
}

double correlation_time(const std::vector<double>& values) {
  const std::size_t n = values.size();
  const double middle = mean(values);
  double squares = 0, time = 1;
  for (const double value : values) squares += (value - middle) * (value - middle);
  if (!(squares > 0)) return 1;
  for (std::size_t lag = 1; lag < n / 2; ++lag) {
    double sum = 0;
    for (std::size_t i = lag; i < n; ++i) sum += (values[i] - middle) * (values[i - lag] - middle);
    const double correlation = sum / squares;
    if (correlation < 0.05) break;
    time += 2 * correlation;
  }
  return time;
}

std::vector<LogFinding> audit(const StandLog& log, const RowSelection& selection) {
  const SpeedSource source = choose_speed(log, selection);
  const auto before = rest_before(log, source), after = rest_after(log, source);
  const double zero_n = before ? before->mean_n : 0;
  // Beside each other: none needs what another finds.
  std::future<Findings> of_series = std::async(launch_for(log.rows.size() * sizeof(StandRow)), [&] {
    Findings findings;
    audit_zero(log, before, after, selection.tare_rows > 0 ? zero_n : 0, findings);
    audit_time(log, findings);
    audit_frozen(log, findings);
    audit_frozen_speed(log, source, findings);
    if (const std::vector<std::size_t> rows = plateau(log, source); !rows.empty()) {
      audit_drift(log, source, rows, findings);
      audit_noise(log, source, rows, findings);
    }
    return findings;
  });
  Findings findings;
  audit_two_speeds(log, findings);
  audit_spikes(log, source, findings);
  audit_standstill(log, source, zero_n, findings);
  audit_current_limit(log, source, findings);
  std::ranges::move(of_series.get(), std::back_inserter(findings));
  if (!log.not_numbers.empty()) {
    add(findings, FindingKind::not_a_number, log.not_numbers.size(), log.not_numbers.front().line,
        "values left out; the first: " + log.not_numbers.front().what);
    for (const TableProblem& field : log.not_numbers) findings.back().lines.push_back(field.line);
  }
  if (log.problems.empty()) return findings;
  add(findings, FindingKind::other_fields, log.problems.size(), log.problems.front().line,
      "lines skipped; the first: " + log.problems.front().what);
  for (const TableProblem& problem : log.problems) findings.back().lines.push_back(problem.line);
  return findings;
}

void flag_steps(ImportedTable& table, const std::vector<LogFinding>& findings) {
  for (const LogFinding& finding : findings) {
    const auto flag = static_cast<std::uint32_t>(flag_of(finding.kind));
    if (flag == 0) continue;
    std::vector<std::size_t> lines = finding.lines;
    std::ranges::sort(lines);
    const bool out = finding.kind == FindingKind::speed_frozen;
    if (out) table.left_out.resize(table.size());
    for (std::size_t i = 0; i < table.size(); ++i) {
      if (!std::ranges::binary_search(lines, table.rows[i].line)) continue;
      table.quality_flags[i] |= flag;
      if (out) table.left_out[i] = true;
    }
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
