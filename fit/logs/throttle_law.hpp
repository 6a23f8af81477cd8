// The law of thrust over throttle that flight stacks want, from a log with both: each stack's own form, fitted to the
// thrust by least squares, with intervals. u is the throttle from 0 to 1 (1000 to 2000 µs), V the voltage, and x the
// throttle between the ends that the stack leaves to its mixer.
//
//   PX4          T = T1 (f x² + (1 − f) x), x = u                       f = THR_MDL_FAC
//   ArduPilot    T = T1 (e x² + (1 − e) x), SPIN_MIN 0.15 to SPIN_MAX 0.95  e = MOT_THST_EXPO
//                the same in x V/Vmax, with its compensation of the voltage: Vmax = MOT_BAT_VOLT_MAX
//   Betaflight   x = m (1 + e (1 − m) (1 + e (1 − 2m))), m = T / T1     e = thrust_linear / 100, from 2026.6 on
//                x = m (1 + t (1 − m)²), 4.2 to 2025.12; x from motor_idle 5.5 % to 1
//   Crazyflie    T = c0 + c1 v + c2 v² + c3 v³, v = u V                 cN = VMOTOR2THRUSTN
//
// Read in August 2026 in PX4's FunctionMotors.hpp, ArduPilot's AP_Motors_Thrust_Linearization.cpp, Betaflight's pid.c
// and crazyflie-firmware's motors.c.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fit/logs/row_selection.hpp"

namespace kphi::fit {

enum class ThrottleForm : std::uint8_t { px4, ardupilot, ardupilot_voltage, betaflight, betaflight_4_2, crazyflie };
inline constexpr std::array kThrottleForms{
    ThrottleForm::px4,        ThrottleForm::ardupilot,      ThrottleForm::ardupilot_voltage,
    ThrottleForm::betaflight, ThrottleForm::betaflight_4_2, ThrottleForm::crazyflie};

/// "px4": in coefficients.yaml.
[[nodiscard]] const char* name_of(ThrottleForm form);

struct ThrottlePoint {
  double throttle = 0;  ///< 0 to 1
  double thrust_n = 0;
  double voltage_v = results::kNotMeasured;
};

struct ThrottleParameter {
  std::string name;  ///< as the stack calls it
  double value = 0;
  double half_95 = 0;  ///< half of the 95 % interval, by the scatter of the rows; 0: chosen, not fitted
};

struct ThrottleLaw {
  ThrottleForm form{};
  std::vector<ThrottleParameter> parameters;
  std::vector<ThrottleForm> not_told_from{};  ///< forms that these rows cannot tell from this one
  double rms_n = 0;
  std::size_t n = 0;  ///< rows between the form's ends
};

/// Thrust of the form in its units; `p`: T1 and the shape, or c0 to c3. `voltage`: V, or its share of Vmax.
[[nodiscard]] double thrust_of_throttle(ThrottleForm form, std::span<const double> p, double throttle, double voltage);

/// nullopt with fewer than 5 points between the form's ends, without a voltage where the form needs it, or where the
/// points do not tell its parameters.
[[nodiscard]] std::optional<ThrottleLaw> fit_throttle(ThrottleForm form, const std::vector<ThrottlePoint>& points);

/// Whether the points that both forms describe tell the two apart: by their residuals, at 5 %. False where one of them
/// cannot be fitted.
[[nodiscard]] bool told_apart(ThrottleForm one, ThrottleForm other, const std::vector<ThrottlePoint>& points);

/// Of the rows that turn; at most 1000 of them. Each law that can be fitted; empty for a log without throttle.
[[nodiscard]] std::vector<ThrottleLaw> throttle_laws(const ImportedTable& table);

/// A line for each law, and one for those that cannot be told from others.
[[nodiscard]] std::vector<std::string> throttle_lines(const std::vector<ThrottleLaw>& laws);

}  // namespace kphi::fit
