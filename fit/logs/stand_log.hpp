// What a thrust stand wrote down, row by row, and the one reader for all its tables. Inside: s, µs, RPM, N, N m, V, A,
// degrees.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/csv.hpp"
#include "fit/logs/layout_finding.hpp"
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
  std::uint32_t line = 0;
  std::uint32_t group = 0;  ///< index into StandLog::groups
  Reading time_s{};
  Reading throttle_us{};
  Reading electrical_rpm{};  ///< counted by the speed controller: needs the motor's pole count
  Reading optical_rpm{};     ///< or of the only source there is; of several rotors the root of the mean square
  double thrust_n = 0;       ///< of several rotors their share
  Reading torque_nm{};
  Reading voltage_v{};
  Reading current_a{};
  Reading target_rpm{};  ///< what a script asked for
  Reading occlusion_deg{};
  Reading repetition{};  ///< a whole number from 1
};

/// The channel of a role; nullptr for the thrust, which every row has, and for text.
using Channel = Reading StandRow::*;
[[nodiscard]] Channel channel_of(Role role);

struct StandLog {
  std::string path;
  std::string thrust_unit;  ///< as in the file
  bool has_electrical = false;
  bool has_optical = false;
  bool turned = false;  ///< the sign of all thrust
  std::vector<StandRow> rows{};
  std::vector<std::string> groups{""};      ///< "5x3, forward": the texts of propeller, motor and direction
  std::vector<TableProblem> problems{};     ///< lines skipped
  std::vector<std::string> unread{};        ///< columns skipped, with the reason
  std::vector<TableProblem> not_numbers{};  ///< values left out of a row that is kept
  Layout layout{};
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

/// A table of any make, by the layout that find_layout() sees in it; throws as that does. Skips and lists the lines
/// whose thrust is not a number.
[[nodiscard]] StandLog read_log(TextBlocks text, const std::string& path, const LayoutHints& hints = {});

/// A table whose layout is known. Throws ConfigurationError (path:line) where its names are others.
[[nodiscard]] StandLog read_log(TextBlocks text, const std::string& path, const Layout& layout);

}  // namespace kphi::fit
