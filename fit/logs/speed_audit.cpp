#include "fit/logs/speed_audit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/statistics.hpp"
#include "compensation/units.hpp"

namespace kphi::fit {
namespace {

constexpr double kTurningRpm = 100;
constexpr double kThrustThere = from_gram_force(5).value();

std::string poles_words(const PoleRatio& ratio) {
  // Electrical speed is the commutation frequency divided by the pole pairs that were set.
  return fmt::format(
      "as if {} poles were set for a motor of {}; take --speed optical, or --speed electrical --speed-factor {}/{}",
      2 * ratio.numerator, 2 * ratio.denominator, ratio.numerator, ratio.denominator);
}

void find_ratio(SpeedComparison& comparison) {
  comparison.poles = pole_ratio(comparison.ratio);
  if (std::abs(comparison.ratio - 1) < 0.01) return;
  Finding finding{.kind = FindingKind::speed_ratio, .rows = comparison.rows};
  finding.text =
      comparison.poles
          ? fmt::format("optical/electrical speed is {:.4f} = {}/{}, {}", comparison.ratio, comparison.poles->numerator,
                        comparison.poles->denominator, poles_words(*comparison.poles))
          : fmt::format(
                "optical/electrical speed is {:.4f}, no ratio of pole counts: one of them is wrong; name "
                "the right one with --speed",
                comparison.ratio);
  comparison.findings.push_back(std::move(finding));
}

void find_outliers(const StandLog& log, SpeedComparison& comparison) {
  std::vector<double> off;
  for (const StandRow& row : log.rows) {
    if (row.electrical_rpm.value_or(0) > kTurningRpm && row.optical_rpm.value_or(0) > kTurningRpm)
      off.push_back(std::abs(*row.optical_rpm / *row.electrical_rpm / comparison.ratio - 1));
  }
  // Two counters read one after the other never agree to the last digit.
  const double tolerance = std::max(3e-3, 6 * 1.4826 * upper_median(off));
  Finding disagrees{.kind = FindingKind::speed_disagrees, .spoils = true};
  Finding dead{.kind = FindingKind::speed_dead, .spoils = true};
  double worst = 0;
  for (const StandRow& row : log.rows) {
    const double electrical = row.electrical_rpm.value_or(0) * comparison.ratio, optical = row.optical_rpm.value_or(0);
    if (std::max(electrical, optical) <= 10 * kTurningRpm) continue;
    const double share = std::min(electrical, optical) / std::max(electrical, optical);
    if (share < 0.2) {
      count(dead, row);
    } else if (std::abs(optical / electrical - 1) > tolerance) {
      count(disagrees, row);
      if (std::abs(optical / electrical - 1) > std::abs(worst)) worst = optical / electrical - 1;
    }
  }
  disagrees.text = fmt::format("the two speeds differ by up to {:+.1f} % from their usual ratio; such rows are flagged",
                               100 * worst);
  dead.text = "one speed sensor stands still while the other turns; such rows are flagged";
  append_if_any(comparison.findings, std::move(disagrees));
  append_if_any(comparison.findings, std::move(dead));
}

/// Above twice what a script asked for, or half as much again as the rows around it.
Finding spikes(const StandLog& log, SpeedSource source) {
  Finding finding{.kind = FindingKind::speed_spike, .spoils = true};
  constexpr std::size_t kAround = 2;
  const auto at = [&](std::size_t i) { return rpm_of(log.rows[i], source).value_or(0); };
  const bool series = log.rows.size() >= 50;
  double highest = 0;
  for (std::size_t i = 0; i < log.rows.size(); ++i) {
    const double target = log.rows[i].target_rpm.value_or(0);
    bool spike = target > 0 && at(i) > 2 * target;
    if (target <= 0 && series && i >= kAround && i + kAround < log.rows.size()) {
      const double around = upper_median({at(i - 2), at(i - 1), at(i + 1), at(i + 2)});
      spike = around > kTurningRpm && at(i) > 1.5 * around;
    }
    if (!spike) continue;
    count(finding, log.rows[i]);
    highest = std::max(highest, at(i));
  }
  finding.text = fmt::format("speed spikes, up to {:.0f} RPM; such rows are flagged", highest);
  return finding;
}

struct Standstill {
  Finding missing{.kind = FindingKind::speed_missing};
  Finding barely{.kind = FindingKind::barely_turning};
  Finding still{.kind = FindingKind::not_turning};
  Finding coasting{.kind = FindingKind::coasting};
  bool turned = false;  ///< in a row before
};

void judge_standstill(const StandRow& row, double rpm, double zero_n, Standstill& found) {
  const bool idle = row.throttle_us && *row.throttle_us <= kIdleUs;
  if (idle && (rpm >= kTurningRpm || (rpm > 0 && found.turned))) {
    count(found.coasting, row);
  } else if (rpm > 0 && rpm < kTurningRpm) {
    count(found.barely, row);
  }
  found.turned = found.turned || rpm >= kTurningRpm;
  if (idle || rpm != 0) return;
  count(row.thrust_n - zero_n > kThrustThere ? found.missing : found.still, row);
}

/// Two neighbouring rows of a rising command between which speed and voltage fall.
Finding current_limit(const StandLog& log, SpeedSource source) {
  constexpr double kSpeedFalls = 0.995, kVoltageFalls = 0.97;
  Finding finding{.kind = FindingKind::current_limit};
  double current = 0, lowest = 0;
  for (std::size_t i = 1; i < log.rows.size(); ++i) {
    const StandRow &before = log.rows[i - 1], &row = log.rows[i];
    const double speed = rpm_of(row, source).value_or(0), speed_before = rpm_of(before, source).value_or(0);
    if (!row.throttle_us || !before.throttle_us || !row.voltage_v || !before.voltage_v) continue;
    if (*row.throttle_us - *before.throttle_us < 20 || speed_before < 10 * kTurningRpm) continue;
    if (speed > kSpeedFalls * speed_before || *row.voltage_v > kVoltageFalls * *before.voltage_v) continue;
    count(finding, row);
    current = std::max(current, row.current_a.value_or(0));
    lowest = finding.rows == 1 ? *row.voltage_v : std::min(lowest, *row.voltage_v);
  }
  finding.text = fmt::format(
      "the supply is at its current limit ({:.2f} A): the command rises, the voltage falls to {:.2f} V and the speed "
      "with it; the commanded speed was not reached",
      current, lowest);
  return finding;
}

}  // namespace

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

SpeedComparison compare_speeds(const StandLog& log) {
  SpeedComparison comparison;
  std::vector<double> ratios;
  for (const StandRow& row : log.rows) {
    if (row.electrical_rpm.value_or(0) > kTurningRpm && row.optical_rpm.value_or(0) > kTurningRpm)
      ratios.push_back(*row.optical_rpm / *row.electrical_rpm);
  }
  comparison.rows = ratios.size();
  if (ratios.size() < 3) return comparison;
  comparison.ratio = upper_median(ratios);
  find_ratio(comparison);
  find_outliers(log, comparison);
  return comparison;
}

std::vector<Finding> audit_speed(const StandLog& log, SpeedSource source, double zero_n) {
  Standstill found;
  for (const StandRow& row : log.rows)
    if (const auto rpm = rpm_of(row, source)) judge_standstill(row, *rpm, zero_n, found);
  found.missing.text = "speed reads 0 while there is thrust: the sensor does not see the propeller; rows left out";
  found.barely.text = "speed below 100 RPM: such rows weigh nothing in a fit, but T/ω² of one means nothing";
  found.still.text = "the motor does not turn with the throttle above idle; rows left out";
  found.coasting.text = "the propeller turns with the throttle idle: such rows are no zero";
  std::vector<Finding> findings;
  append_if_any(findings, spikes(log, source));
  append_if_any(findings, std::move(found.missing));
  append_if_any(findings, std::move(found.barely));
  append_if_any(findings, std::move(found.still));
  append_if_any(findings, std::move(found.coasting));
  append_if_any(findings, current_limit(log, source));
  return findings;
}

}  // namespace kphi::fit
