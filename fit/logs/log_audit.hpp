// What is wrong with a stand log: speeds (they enter k squared), zero (5 % of the largest thrust untared is 7 % in k),
// time series, lines.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/logs/row_selection.hpp"

namespace kphi::fit {

enum class FindingKind : std::uint8_t {
  speed_ratio,         ///< two speeds at a fixed ratio other than 1: pole count
  speed_disagrees,     ///< single rows off that ratio
  speed_dead,          ///< one of two speeds (almost) still while the other turns
  speed_spike,         ///< far above the target, or above the rows before and after
  speed_missing,       ///< 0 while there is thrust
  barely_turning,      ///< above 0, below 100 RPM
  not_turning,         ///< throttle above idle, no speed, no thrust
  coasting,            ///< turning with the throttle idle
  current_limit,       ///< command up, voltage and speed down
  untared,             ///< thrust with the motor off is not 0
  zero_missing,        ///< a time series without rows with the motor off
  zero_drifted,        ///< before and after differ
  zero_scatters,       ///< cannot give a tare
  negative_thrust,     ///< rows below 0
  thrust_frozen,       ///< the same bits many times
  thrust_drifts,       ///< T/ω² changes at constant speed
  correlated_noise,    ///< rows of a plateau are not independent
  time_backward,       ///< stamps earlier than the one before
  time_repeated,       ///< equal stamps
  not_a_number,        ///< fields of a channel that contain something else
  other_fields,        ///< lines that do not fit the header
  k_unlike_its_group,  ///< among files of one propeller
  speed_frozen,        ///< the same speed many times while the thrust changes
  speed_doubled,       ///< twice or half of what the thrust needs
  row_unlike,          ///< among few rows, far from the curve of all others
  speed_stepped,       ///< a counter of few pulses
  zero_fitted,         ///< never tared, and no rows with the motor off: the offset of thrust over ω² is taken
  zero_unknown,        ///< no such rows, and speeds too alike to tell
  several_groups,      ///< rows of several things, fitted apart
  one_k_misfits,       ///< one k does not describe the rows
  speed_too_low,       ///< no row reaches 100 RPM
};

/// "speed_ratio"
[[nodiscard]] const char* name_of(FindingKind kind);

/// One k for a log with such a finding means nothing.
[[nodiscard]] bool spoils_k(FindingKind kind);

struct LogFinding {
  FindingKind kind{};
  std::size_t rows = 0;
  std::size_t first_line = 0;        ///< 0: of the whole file
  std::string text{};                ///< what, how large, next move
  std::vector<std::size_t> lines{};  ///< of every row concerned
};

/// In the order of FindingKind's families: speeds, zero, series, lines. Judges the speed that `selection` takes and the
/// tare that it asks for.
[[nodiscard]] std::vector<LogFinding> audit(const StandLog& log, const RowSelection& selection);

/// Flags the steps of the rows concerned: a wrong speed or frozen thrust spoils a step, a supply at its limit does not
/// (T = k ω² still holds).
void flag_steps(ImportedTable& table, const std::vector<LogFinding>& findings);

/// Two whole numbers whose quotient is the ratio of two speed sources.
struct PoleRatio {
  int numerator = 1;
  int denominator = 1;
};
/// p/q with p, q up to 24 and p ≠ q nearest to `ratio` within 0.2 %, smallest numbers first; nullopt within 1 % of 1.
[[nodiscard]] std::optional<PoleRatio> pole_ratio(double ratio);

/// Sum of the autocorrelation, 1 + 2 Σ ρ, up to its first value below 0.05: this many rows count as one.
[[nodiscard]] double correlation_time(const std::vector<double>& values);

struct NamedCoefficient {
  std::string name;
  double k = 0;
};

/// Among files of one propeller: those whose k is further from the median than four robust standard deviations
/// (1.4826 MAD) and 5 %. Needs five files.
struct GroupOutlier {
  std::string name;
  double share = 0;      ///< k / median − 1
  double robust_sd = 0;  ///< of the group, as a share of its median
};
[[nodiscard]] std::vector<GroupOutlier> group_outliers(std::span<const NamedCoefficient> group);

}  // namespace kphi::fit
