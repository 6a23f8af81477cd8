// Tables of Tyto/RCbenchmark thrust stands (Series 1520, 1580/1585, 1780). The unit of thrust differs between files and
// stands only in the header; which speed is right (electrical needs the motor's pole count) the file does not say.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "fit/csv.hpp"
#include "fit/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

enum class SpeedSource { electrical, optical };

/// One line of the file. A channel that is absent or empty is nothing.
struct RcbenchmarkRow {
  std::size_t line = 0;
  std::optional<double> time_s;
  std::optional<double> esc_us;
  std::optional<double> electrical_rpm;
  std::optional<double> optical_rpm;
  double thrust_n = 0;
  std::optional<double> torque_nm;
  std::optional<double> voltage_v;
  std::optional<double> current_a;
};

struct RcbenchmarkLog {
  std::string path;
  std::string thrust_unit;  ///< as in the header: "gf", "kgf" or "N"
  bool has_electrical = false;
  bool has_optical = false;
  std::vector<RcbenchmarkRow> rows;
  std::vector<TableProblem> problems;  ///< lines left out
};

/// Throws ConfigurationError (path:line) when the thrust column, its unit or both speed columns are missing or stand
/// twice. Lines whose thrust is no number are left out and listed.
[[nodiscard]] RcbenchmarkLog read_rcbenchmark(std::string_view text, std::string path);

/// Which rows become points, and how.
struct RcbenchmarkSelection {
  /// Default: electrical where the file has it above 0 anywhere, else optical.
  std::optional<SpeedSource> speed{};
  double speed_factor = 1;     ///< on the chosen speed: 7/6 mends an electrical speed taken with 14 instead of 12 poles
  double speed_above_rpm = 0;  ///< rows at or below are no points (before the factor)
  std::optional<double> esc_above_us{};
  /// Rows in which optical/electrical is within `ratio_tolerance` of this one only: two sensors that agree.
  std::optional<double> optical_per_electrical{};
  double ratio_tolerance = 0.02;
  /// Tare with the mean of the first rows that have the motor off (ESC at most `off_esc_us`, speed 0); 0: none.
  std::size_t tare_rows = 0;
  double off_esc_us = 1000.5;
  bool reverse_thrust = false;  ///< the stand was wired with the other sign
};

struct ImportedTable {
  std::vector<results::StepMean> steps;  ///< repetition 1, φ = 0, no doubts; `step` counts the rows used
  double tare_n = 0;                     ///< subtracted from every thrust
  std::string unit;                      ///< of thrust in the file, or what it was computed from
  std::string speed_source;
  std::size_t rows_total = 0;
  std::vector<TableProblem> problems;
};

/// Throws ConfigurationError (path:line) when the asked channel is not in the file, no row is left, too few rows are
/// there to tare with, or thrust falls with speed (reversed sign).
[[nodiscard]] ImportedTable select_rows(const RcbenchmarkLog& log, const RcbenchmarkSelection& selection = {});

/// The steps as equally weighted points.
[[nodiscard]] std::vector<Point> points_of(const std::vector<results::StepMean>& steps);

/// Σ T ω² must be positive. Throws ConfigurationError at path:header_line otherwise.
void refuse_reversed_thrust(const std::vector<results::StepMean>& steps, const std::string& path);

}  // namespace kphi::fit
