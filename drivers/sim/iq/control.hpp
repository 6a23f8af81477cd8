// What the module's firmware computes in each tick: from what was commanded and what it measures to the duty of the
// power stage. Feed-forward and PID, derating, current clamp by the module's own model of the motor, the limiter of
// regeneration, slew limit; how a motion ends by itself; safe mode.
#pragma once

#include <cstdint>

#include "base/clock.hpp"
#include "drivers/sim/iq/entries.hpp"
#include "drivers/sim/iq/sensors.hpp"
#include "drivers/sim/physics/motor.hpp"

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

/// How the module ends a motion by itself, after a communication timeout or a disarming: at once or through 0 V, then
/// its song, then coast or brake.
class IqEnding {
 public:
  struct Plan {
    int behavior = 0;          ///< 0 coast, 1 0 V then coast, 2 0 V then brake
    int song = 0;              ///< 0 never, 1 once, 2 continuously: the end is never reached
    double stopped_speed = 5;  ///< rad/s
    double stopped_time = 1;   ///< s
  };
  void begin(const Plan& plan, Instant now) noexcept;
  void cancel() noexcept { phase_ = Phase::none; }
  /// What to drive while it lasts, and at its end.
  void step(double speed, Instant now, MotorDrive& drive) noexcept;
  [[nodiscard]] bool going_on() const noexcept { return phase_ != Phase::none; }
  [[nodiscard]] bool singing() const noexcept { return phase_ == Phase::singing && plan_.song != 0; }
  /// Only a command to spin or an arming ends it.
  [[nodiscard]] bool endless() const noexcept { return singing() && plan_.song == 2; }

 private:
  enum class Phase : std::uint8_t { none, slowing, singing };
  void slow_down(double speed, Instant now) noexcept;

  Plan plan_;
  Phase phase_ = Phase::none;
  Instant since_{0};
  Instant slow_since_ = kNever;
};

/// power_safety: which limits are crossed, and whether the module is in safe mode.
class IqSafety {
 public:
  /// Checks every limit. True: safe mode has just started.
  bool check(const IqMemory& memory, const IqReadings& readings) noexcept;
  /// A write of fault_ever: these bits stay.
  void clear(std::uint8_t keep) noexcept { ever_ &= keep; }
  void power_up() noexcept { now_ = ever_ = 0; }

  [[nodiscard]] std::uint8_t now() const noexcept { return now_; }
  [[nodiscard]] std::uint8_t ever() const noexcept { return ever_; }
  /// No spin, no voltage.
  [[nodiscard]] bool safe_mode() const noexcept { return safe_; }

 private:
  std::uint8_t now_ = 0;
  std::uint8_t ever_ = 0;
  bool safe_ = false;
};

/// (end - x)/(end - start) within 0..1.
[[nodiscard]] double derate_between(double start, double end, double x) noexcept;

}  // namespace kphi::sim
