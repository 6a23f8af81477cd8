// What a thrust stand wrote down, row by row, and the one reader for all its CSV files. Inside: s, µs, RPM, N, N m, V,
// A, degrees.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/csv.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

enum class SpeedSource : std::uint8_t { electrical, optical };

/// A number that a log may lack: std::optional<double> in half the memory. Never NaN.
class Reading {
 public:
  Reading() = default;
  Reading(double value) : value_(value) {}
  explicit operator bool() const { return !std::isnan(value_); }
  double operator*() const { return value_; }
  bool operator==(double other) const { return value_ == other; }
  [[nodiscard]] double value_or(double other) const { return *this ? value_ : other; }

 private:
  double value_ = results::kNotMeasured;
};

/// One line of the file; a channel that is absent or empty has no reading.
struct StandRow {
  std::size_t line = 0;
  Reading time_s{};
  Reading throttle_us{};
  Reading electrical_rpm{};  ///< counted by the speed controller: needs the motor's pole count
  Reading optical_rpm{};     ///< or of the only source there is
  double thrust_n = 0;
  Reading torque_nm{};
  Reading voltage_v{};
  Reading current_a{};
  Reading target_rpm{};  ///< what a script asked for
  Reading occlusion_deg{};
  Reading repetition{};  ///< a whole number from 1
};

struct StandLog {
  std::string path;
  std::string thrust_unit;  ///< as in the file
  bool has_electrical = false;
  bool has_optical = false;
  std::vector<StandRow> rows{};
  std::vector<TableProblem> problems{};     ///< lines skipped
  std::vector<std::string> unread{};        ///< columns skipped, with the reason
  std::vector<TableProblem> not_numbers{};  ///< values left out of a row that is kept
};

[[nodiscard]] inline Reading rpm_of(const StandRow& row, SpeedSource source) {
  return source == SpeedSource::electrical ? row.electrical_rpm : row.optical_rpm;
}

/// Throttle at or below this is idle: the motor is commanded to stand still.
inline constexpr double kIdleUs = 1000.5;

/// Throttle idle and no speed.
[[nodiscard]] bool motor_off(const StandRow& row, SpeedSource source);

/// |thrust| in N; 0 without rows.
[[nodiscard]] double largest_thrust(const StandLog& log);

/// What a column measures, and the unit inside: s, µs, RPM, N, N m, V, A, degree, 1.
enum class Measure { time, throttle, speed, thrust, torque, voltage, current, angle, count };

struct HeaderName {
  std::string name;
  std::string unit;  ///< as written; empty: no unit
};

/// "Thrust (gf)" and "Thrust [gf]" → Thrust, gf. Without brackets all of it is the name.
[[nodiscard]] HeaderName split_header(std::string_view header);

/// The unit after a '_' at the end of a header without brackets ("thrust_n", "speed_rad_s"); empty if the measure has
/// no such unit.
[[nodiscard]] std::string unit_suffix(std::string_view name, Measure measure);

/// Factor from `unit` to the unit inside; nullopt for a unit that the measure does not have. Case counts only where two
/// units differ by it (mN, MN).
[[nodiscard]] std::optional<double> unit_factor(Measure measure, std::string_view unit);

/// What a column contains, by the member of a row; kThrust: the thrust, which every row has.
using Role = Reading StandRow::*;
inline constexpr Role kThrust = nullptr;

struct ColumnRole {
  Role role{};
  std::string header;  ///< the whole header, or its part before the unit
  std::string unit;    ///< empty: the header gives it
};

/// "thrust=Load [g]", "speed=n:rpm": role, header and, behind the last ':', a unit that the header does not give.
/// Throws ConfigurationError that lists the roles.
[[nodiscard]] ColumnRole parse_column_role(std::string_view text);

/// Of a table of any make.
struct CsvDialect {
  char separator = 0;          ///< 0: the one of , ; tab that the header line has most of
  bool decimal_comma = false;  ///< 1,5 is one and a half
};

/// A table of any make with the given columns. Needs a thrust and a speed. Throws ConfigurationError (path:line) when a
/// column is missing or there twice, its unit is unknown, not given, or another one in header and role. Skips and lists
/// the lines whose thrust is not a number.
[[nodiscard]] StandLog read_columns(TextBlocks text, std::string path, const std::vector<ColumnRole>& columns,
                                    const CsvDialect& dialect = {});

/// A table of a Tyto/RCbenchmark stand (Series 1520, 1580/1585, 1780). Its columns have known names; their units differ
/// between files. The file does not say which speed is right: the electrical one needs the motor's pole count. Throws
/// as read_columns does; skips and lists a column in an unknown unit, unless it is the thrust or a speed.
[[nodiscard]] StandLog read_rcbenchmark(TextBlocks text, std::string path, const CsvDialect& dialect = {});

}  // namespace kphi::fit
