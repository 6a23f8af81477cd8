// What the module's firmware computes in each tick: from what was commanded and what it measures to the duty of the
// power stage. Feed-forward and PID, derating, current clamp by the module's own model of the motor, the limiter of
// regeneration, slew limit.
#pragma once

#include <cstdint>

#include "drivers/sim/motor.hpp"

namespace kphi::sim {

/// What was commanded, and the tuning.
struct MotorDrive {
  enum class Mode : std::uint8_t { brake, coast, volts, pwm, velocity };
  Mode mode = Mode::coast;
  double target = 0;                 ///< V, 1 or rad/s, by mode
  double kp = 0, ki = 0, kd = 0;     ///< V/(rad/s), V/rad, V/(rad/s²)
  double ff0 = 0, ff1 = 0, ff2 = 0;  ///< V, V/(rad/s), V/(rad/s)²
  double input_filter_hz = 100;      ///< low-pass on the velocity command
  double addition = 0;               ///< V, on top of all: the buzzer
};

/// The module's model of its motor, and its limits.
struct IqLimits {
  double resistance = 0.045;        ///< ohm
  double emf_constant = 0.0043406;  ///< V/(rad/s)
  double amps_max = 30, amps_soft_start = 28, amps_soft_end = 30;
  double volts_start = 26, volts_limit = 27;  ///< of the supply: where the limiter of regeneration begins and ends
  double redline_start = 3400, redline_end = 3500;
  double slew = 0;     ///< V/s; 0: none
  double thermal = 1;  ///< product of the temperatures' derates
};

/// What the firmware measures.
struct IqSensed {
  double speed = 0;         ///< rad/s
  double supply_volts = 0;  ///< V
};

class IqControl {
 public:
  [[nodiscard]] PowerStage step(const MotorDrive& drive, const IqLimits& limits, const IqSensed& sensed) noexcept;
  /// All factors of the last tick: 1 = none.
  [[nodiscard]] double derate() const noexcept { return derate_; }
  /// V across the motor, after limiting, as the firmware believes.
  [[nodiscard]] double volts() const noexcept { return volts_; }

 private:
  [[nodiscard]] double demanded(const MotorDrive& drive, const IqSensed& sensed) noexcept;
  [[nodiscard]] double limited(double volts, const IqLimits& limits, const IqSensed& sensed) const noexcept;
  void integrate(const MotorDrive& drive, double demanded, double given) noexcept;

  double filtered_target_ = 0;
  double error_ = 0;
  double integral_ = 0;  ///< of the speed error, V
  double last_speed_ = 0;
  double derate_ = 1;
  double volts_ = 0;
};

/// (end - x)/(end - start) within 0..1.
[[nodiscard]] double derate_between(double start, double end, double x) noexcept;

}  // namespace kphi::sim
