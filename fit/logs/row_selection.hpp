// Which rows of a stand log become steps, and how.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/logs/stand_log.hpp"
#include "fit/model/step_selection.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

struct RowSelection {
  /// Default: electrical where the file has it above 0 anywhere, else optical.
  std::optional<SpeedSource> speed{};
  double speed_factor = 1;     ///< on the chosen speed: 7/6 corrects an electrical speed taken with 14 poles, not 12
  double speed_above_rpm = 0;  ///< rows at or below are skipped (before the factor)
  std::optional<double> throttle_above_us{};
  /// Takes only rows whose optical/electrical is within `ratio_tolerance` of this: two sensors that agree.
  std::optional<double> optical_per_electrical{};
  double ratio_tolerance = 0.02;
  /// Tare with the mean of the first rows that have the motor off (throttle idle, speed 0); 0: no tare.
  std::size_t tare_rows = 0;
  bool reverse_thrust = false;  ///< the stand measured thrust with the other sign
};

/// Rows that scatter by more than this share of the largest thrust cannot give a zero.
inline constexpr double kTareScatterMax = 0.02;

struct ImportedTable {
  std::vector<results::StepMean> steps;  ///< repetition 1, φ = 0 unless the file says; `step` counts the rows used
  std::vector<std::size_t> lines;        ///< of each step, in the file
  double tare_n = 0;                     ///< subtracted from every thrust
  std::string unit;                      ///< of thrust in the file, or what it was computed from
  std::string speed_source;
  std::size_t rows_total = 0;
  std::vector<TableProblem> problems;
  std::vector<std::string> unread;  ///< columns skipped, with the reason
};

/// A step from one row: what a row cannot give is not measured.
[[nodiscard]] results::StepMean step_of_row(double speed_rpm, double thrust_n);

/// The source that `selection` takes. Throws ConfigurationError if the file does not have it.
[[nodiscard]] SpeedSource choose_speed(const StandLog& log, const RowSelection& selection);

/// Throws ConfigurationError (path:line) when the chosen channel is missing, no row is left, the rows for the tare are
/// too few or scatter too much, or thrust falls with speed (reversed sign).
[[nodiscard]] ImportedTable select_rows(const StandLog& log, const RowSelection& selection = {});

/// Σ T ω² must be positive. Throws ConfigurationError at path:1 otherwise.
void refuse_reversed_thrust(const std::vector<results::StepMean>& steps, const std::string& path);

}  // namespace kphi::fit
