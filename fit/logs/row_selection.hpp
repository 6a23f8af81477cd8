// Which rows of a stand log become steps, and how: speed, tare, sign.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/logs/stand_log.hpp"
#include "fit/model/thrust_fit.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

struct RowSelection {
  /// Default: electrical where the file has it above 0 anywhere, else optical.
  std::optional<SpeedSource> speed{};
  double speed_factor = 1;     ///< on the chosen speed: 7/6 corrects an electrical speed taken with 14 poles, not 12
  double speed_above_rpm = 0;  ///< rows at or below are skipped (before the factor)
  std::optional<double> throttle_above_us{};
  /// Tare with the mean of the first rows that have the motor off (throttle idle, speed 0); 0: no tare.
  std::size_t tare_rows = 0;
  bool tared = false;           ///< a person says so: the zero is taken as it is
  bool reverse_thrust = false;  ///< the stand measured thrust with the other sign
};

/// Rows that scatter by more than this share of the largest thrust cannot give a zero.
inline constexpr double kTareScatterMax = 0.02;

/// The rows that were taken, and what makes steps of them.
struct ImportedTable {
  std::vector<StandRow> rows;
  std::vector<std::uint32_t> quality_flags;  ///< of each row
  Channel speed = &StandRow::optical_rpm;
  double speed_factor = 1;
  std::vector<bool> left_out;               ///< rows that no k is taken from; empty: none
  double tare_n = 0;                        ///< subtracted from every thrust
  double zero_u_n = results::kNotMeasured;  ///< standard uncertainty of the tare; all rows share it
  bool reverse_thrust = false;              ///< the thrust of all rows has been turned
  std::string propeller;
  int blades = 0;
  double diameter_in = 0;
  double air_density_kg_m3 = results::kNotMeasured;
  std::string unit;  ///< of thrust in the file, or what it was computed from
  std::string speed_source;
  std::size_t rows_total = 0;
  std::vector<TableProblem> problems;
  std::vector<std::string> unread;  ///< columns skipped, with the reason

  [[nodiscard]] std::size_t size() const { return rows.size(); }
  [[nodiscard]] bool is_left_out(std::size_t row) const { return row < left_out.size() && left_out[row]; }
  [[nodiscard]] double speed_rad_s(std::size_t row) const;
  [[nodiscard]] double thrust_n(std::size_t row) const;
  /// Repetition 1, φ = 0 unless the file says; `step` counts the rows. What a row cannot give is not measured.
  [[nodiscard]] results::StepMean step(std::size_t row) const;
};

/// One point a row, without uncertainties.
[[nodiscard]] std::vector<Point> points_of(const ImportedTable& imported);
/// Of at most 20,000 of the rows that are not left out, from all over the log: enough to judge by.
[[nodiscard]] std::vector<Point> some_points(const ImportedTable& imported);

/// The source that `selection` takes. Throws ConfigurationError if the file does not have it.
[[nodiscard]] SpeedSource choose_speed(const StandLog& log, const RowSelection& selection);

/// Turns the sign of each thrust.
void turn_thrust(StandLog& log);

/// Throws ConfigurationError (path:line) when the chosen channel is missing, no row is left, the rows for the tare are
/// too few or scatter too much, the speed reads 0 in most rows with thrust, or thrust falls with speed (reversed sign);
/// FitError when thrust does not follow speed at all.
[[nodiscard]] ImportedTable select_rows(StandLog log, const RowSelection& selection = {});

/// Thrust must grow with ω², whatever its zero is. Throws ConfigurationError at path:1 where it falls, FitError where
/// the log cannot tell.
void refuse_reversed_thrust(const ImportedTable& imported, const std::string& path);

}  // namespace kphi::fit
