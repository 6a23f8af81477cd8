// What a thrust stand of any make wrote down, row by row, before anybody judged it. Units: s, µs, RPM, N, N m, V, A,
// degrees.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "fit/csv.hpp"

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

}  // namespace kphi::fit
