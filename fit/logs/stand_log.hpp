// What a thrust stand of any make wrote down, row by row, and the findings of the audits about it. Units: s, µs, RPM,
// N, N m, V, A, degrees.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/csv.hpp"

namespace kphi::fit {

enum class SpeedSource { electrical, optical };

/// One line of the file. A channel that is absent or empty is nothing.
struct StandRow {
  std::size_t line = 0;
  std::optional<double> time_s{};
  std::optional<double> throttle_us{};
  std::optional<double> electrical_rpm{};  ///< counted by the speed controller: needs the motor's pole count
  std::optional<double> optical_rpm{};     ///< or of the only source there is
  double thrust_n = 0;
  std::optional<double> torque_nm{};
  std::optional<double> voltage_v{};
  std::optional<double> current_a{};
  std::optional<double> target_rpm{};  ///< what a script asked for
  std::optional<double> occlusion_deg{};
  std::optional<int> repetition{};
};

struct StandLog {
  std::string path;
  std::string thrust_unit;  ///< as in the file
  bool has_electrical = false;
  bool has_optical = false;
  std::vector<StandRow> rows{};
  std::vector<TableProblem> problems{};  ///< lines left out
  std::vector<std::string> unread{};     ///< columns left out, with the reason
};

[[nodiscard]] inline std::optional<double> rpm_of(const StandRow& row, SpeedSource source) {
  return source == SpeedSource::electrical ? row.electrical_rpm : row.optical_rpm;
}

/// Throttle at or below this is idle: the motor is told to stand still.
inline constexpr double kIdleUs = 1000.5;

/// Throttle idle and no speed.
[[nodiscard]] bool motor_off(const StandRow& row, SpeedSource source);

/// |thrust| in N; 0 without rows.
[[nodiscard]] double largest_thrust(const StandLog& log);

/// What is wrong with a foreign log: a name, a count, where it begins, and one line that says what to do.
enum class FindingKind {
  speed_ratio,         ///< two speeds at a fixed ratio other than 1: pole count
  speed_disagrees,     ///< single rows off that ratio
  speed_dead,          ///< one of two speeds (almost) still while the other turns
  speed_spike,         ///< far above the target, or above the rows before and after
  speed_missing,       ///< 0 while there is thrust
  barely_turning,      ///< above 0, below 100 RPM
  not_turning,         ///< throttle above idle, no speed, no thrust
  coasting,            ///< turning with the throttle idle
  current_limit,       ///< command up, voltage and speed down
  untared,             ///< thrust of the still motor is not 0
  zero_missing,        ///< a time series without rows of a still motor
  zero_drifted,        ///< before and after differ
  zero_scatters,       ///< no tare can be taken there
  negative_thrust,     ///< rows below 0
  thrust_frozen,       ///< the same bits many times
  thrust_drifts,       ///< T/ω² changes at constant speed
  correlated_noise,    ///< rows of a plateau are not independent
  time_backward,       ///< stamps earlier than the one before
  time_repeated,       ///< equal stamps
  other_fields,        ///< lines that do not fit the header
  k_unlike_its_group,  ///< among files of one propeller
};

struct Finding {
  FindingKind kind{};
  std::size_t rows = 0;
  std::size_t first_line = 0;        ///< 0: of the whole file
  std::string text{};                ///< what, how large, what to do
  std::vector<std::size_t> lines{};  ///< of every row concerned
  bool spoils = false;               ///< the rows' speed or thrust is wrong; their steps become doubtful
};

/// "speed_ratio"
[[nodiscard]] const char* name_of(FindingKind kind);

/// The row's number counts into the finding; its text is set once by the caller.
void count(Finding& finding, const StandRow& row);

/// The finding if it has rows.
void append_if_any(std::vector<Finding>& findings, Finding finding);

}  // namespace kphi::fit
