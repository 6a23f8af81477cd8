// Is what the module did during a step good enough to be a measurement? Pure functions over what it reported.
//
// A gate is open, shut, or unknown: nothing was read that could decide it. Unknown is told apart, never taken as open.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "drivers/iq/entries.hpp"

namespace kphi::iq {

enum class Gate : std::uint8_t {
  derate,             ///< brushless_drive.derate is exactly 65536: the module held no voltage back
  coil_derate,        ///< coil_temperature_estimator.derate (temperature_estimator.derate) is 1 (65536)
  controller_derate,  ///< temperature_monitor_uc.derate is 1
  saturation,         ///< |drive_pwm| stayed below the limit: the controller had voltage left
  fault,              ///< power_safety.fault_now was 0
  speed,              ///< obs_velocity kept within tolerance of the command
  supply_voltage,     ///< power_monitor.volts kept within its band
  coil_temperature,   ///< t_coil kept below the limit
};
inline constexpr int kGates = 8;

[[nodiscard]] constexpr std::string_view name_of(Gate gate) noexcept {
  constexpr std::string_view names[kGates] = {"derated", "coil derated", "controller derated", "drive saturated",
                                              "fault",   "speed off",    "supply voltage off", "coil hot"};
  return names[static_cast<int>(gate)];
}

/// Lowest and highest of what was read; empty before the first. A NaN stays: it opens no gate.
struct Span {
  double lowest = std::numeric_limits<double>::infinity();
  double highest = -std::numeric_limits<double>::infinity();
  std::uint64_t count = 0;

  void add(double value) noexcept;
  [[nodiscard]] bool empty() const noexcept { return count == 0; }
  [[nodiscard]] bool within(double low, double high) const noexcept { return lowest >= low && highest <= high; }
};

/// What the module reported while a step was measured.
class StepReadings {
 public:
  /// In the entry's own unit, as the module sent it. Entries that no gate needs are passed over.
  void add(const Entry& entry, double value) noexcept;

  [[nodiscard]] const Span& of(Gate gate) const noexcept { return spans_[static_cast<int>(gate)]; }

 private:
  Span spans_[kGates];
};

struct QualityLimits {
  double commanded_speed_rad_s = 0;  ///< signed
  double speed_share = 0.01;         ///< tolerance: this share of the command …
  double speed_least_rad_s = 5;      ///< … and at least this
  double drive_pwm = 0.98;           ///< shut from here on
  double supply_lowest_v = 0;
  double supply_highest_v = std::numeric_limits<double>::infinity();
  double coil_temperature_max_degc = std::numeric_limits<double>::infinity();
};

/// One bit per Gate.
struct Verdict {
  std::uint32_t shut = 0, unknown = 0;
  [[nodiscard]] constexpr bool is_shut(Gate gate) const noexcept { return (shut >> static_cast<int>(gate) & 1) != 0; }
  [[nodiscard]] constexpr bool is_unknown(Gate gate) const noexcept {
    return (unknown >> static_cast<int>(gate) & 1) != 0;
  }
  [[nodiscard]] bool good() const noexcept { return shut == 0; }
  /// "derated, drive saturated": what is shut.
  [[nodiscard]] std::string words() const;
};

[[nodiscard]] Verdict judge(const StepReadings& readings, const QualityLimits& limits) noexcept;

/// Whether to wait before the next run, with hysteresis: a pause begins above `pause_above` and ends below
/// `resume_below`. A temperature that is not a number begins a pause and ends none.
struct CoolingRule {
  double pause_above_degc = std::numeric_limits<double>::infinity();
  double resume_below_degc = std::numeric_limits<double>::infinity();
  [[nodiscard]] bool pauses(bool pausing, double coil_temperature_degc) const noexcept {
    return pausing ? !(coil_temperature_degc < resume_below_degc) : !(coil_temperature_degc <= pause_above_degc);
  }
};

}  // namespace kphi::iq
