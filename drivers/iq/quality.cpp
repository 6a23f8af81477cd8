#include "drivers/iq/quality.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::iq {
namespace {

constexpr double kFix16 = 65536;

struct Watched {
  const Entry* entry;
  Gate gate;
  double unit;  ///< what is divided by
};

constexpr Watched kWatched[] = {
    {&entry<"brushless_drive.derate">, Gate::derate, kFix16},
    {&entry<"coil_temperature_estimator.derate">, Gate::coil_derate, 1},
    {&entry<"temperature_estimator.derate">, Gate::coil_derate, kFix16},
    {&entry<"temperature_monitor_uc.derate">, Gate::controller_derate, 1},
    {&entry<"brushless_drive.drive_pwm">, Gate::saturation, 1},
    {&entry<"power_safety.fault_now">, Gate::fault, 1},
    {&entry<"brushless_drive.obs_velocity">, Gate::speed, 1},
    {&entry<"power_monitor.volts">, Gate::supply_voltage, 1},
    {&entry<"coil_temperature_estimator.t_coil">, Gate::coil_temperature, 1},
    {&entry<"temperature_estimator.temp">, Gate::coil_temperature, 1},
};

bool is_open(Gate gate, const Span& read, const QualityLimits& limits) noexcept {
  switch (gate) {
    case Gate::derate:
    case Gate::coil_derate:
    case Gate::controller_derate:
      return read.within(1, 1);
    case Gate::saturation:
      return read.lowest > -limits.drive_pwm && read.highest < limits.drive_pwm;
    case Gate::fault:
      return read.within(0, 0);
    case Gate::speed: {
      const double speed = limits.commanded_speed_rad_s;
      const double tolerance = std::max(limits.speed_share * std::abs(speed), limits.speed_least_rad_s);
      return read.within(speed - tolerance, speed + tolerance);
    }
    case Gate::supply_voltage:
      return read.within(limits.supply_lowest_v, limits.supply_highest_v);
    case Gate::coil_temperature:
      return read.highest < limits.coil_temperature_max_degc;
  }
  return false;
}

}  // namespace

void Span::add(double value) noexcept {
  ++count;
  if (std::isnan(value) || std::isnan(lowest)) {
    lowest = highest = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  lowest = std::min(lowest, value);
  highest = std::max(highest, value);
}

void StepReadings::add(const Entry& entry, double value) noexcept {
  const auto* watched =
      std::find_if(std::begin(kWatched), std::end(kWatched), [&](const Watched& w) { return w.entry == &entry; });
  if (watched != std::end(kWatched)) spans_[static_cast<int>(watched->gate)].add(value / watched->unit);
}

Verdict judge(const StepReadings& readings, const QualityLimits& limits) noexcept {
  Verdict verdict;
  for (int i = 0; i < kGates; ++i) {
    const Span& read = readings.of(static_cast<Gate>(i));
    if (read.empty()) {
      verdict.unknown |= 1u << i;
    } else if (!is_open(static_cast<Gate>(i), read, limits)) {
      verdict.shut |= 1u << i;
    }
  }
  return verdict;
}

std::string Verdict::words() const {
  std::string text;
  for (int i = 0; i < kGates; ++i) {
    if (is_shut(static_cast<Gate>(i))) text += (text.empty() ? "" : ", ") + std::string(name_of(static_cast<Gate>(i)));
  }
  return text;
}

}  // namespace kphi::iq
