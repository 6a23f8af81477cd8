// The law of thrust over throttle that flight stacks want, from a log with both: each stack's own form, fitted to the
// thrust by least squares, with intervals.
//
//   PX4, ArduPilot   T = T1 (f u² + (1 − f) u)              f = THR_MDL_FAC = MOT_THST_EXPO
//   Betaflight       u = m (1 + t (1 − m)²), m = T / T1     t = thrust_linear / 100
//   Crazyflie        u V = a T + b T²                       with the battery's voltage V
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "fit/logs/row_selection.hpp"

namespace kphi::fit {

enum class ThrottleForm : std::uint8_t { px4, ardupilot, betaflight, crazyflie };

struct ThrottlePoint {
  double throttle = 0;  ///< 0 to 1
  double thrust_n = 0;
  double voltage_v = results::kNotMeasured;
};

struct ThrottleParameter {
  std::string name;  ///< as the stack calls it, or "a in V/N"
  double value = 0;
  double half_95 = 0;  ///< half of the 95 % interval, by the scatter of the rows
};

struct ThrottleLaw {
  ThrottleForm form{};
  std::vector<ThrottleParameter> parameters;
  double full_thrust_n = 0;  ///< at full throttle; NaN for crazyflie, where it goes with the voltage
  double rms_n = 0;
  std::size_t n = 0;
};

/// Thrust of the form in its units; `p`: T1 and f, T1 and t, or a and b.
[[nodiscard]] double thrust_of_throttle(ThrottleForm form, const double (&p)[2], double throttle, double voltage_v);

/// nullopt with fewer than 5 points, without a voltage where the form needs it, or where the points do not tell its
/// parameters.
[[nodiscard]] std::optional<ThrottleLaw> fit_throttle(ThrottleForm form, const std::vector<ThrottlePoint>& points);

/// Whether the rows tell the two apart: by their residuals, at 5 %.
[[nodiscard]] bool told_apart(const ThrottleLaw& one, const ThrottleLaw& other);

/// Of the rows that turn, with a throttle of 1000 to 2000 µs as 0 to 1. A few lines: each law that can be fitted, and
/// which of them the rows cannot tell apart; empty for a log without throttle.
[[nodiscard]] std::vector<std::string> throttle_lines(const ImportedTable& table);

}  // namespace kphi::fit
