// What the module measures and what it estimates: converter ticks, first-order filters, noise, the error of its clock;
// current, torque and coil temperature by its own model, with its own numbers. One step per tick of the bench.
#pragma once

#include <cstdint>

#include "base/random.hpp"
#include "drivers/sim/iq/entries.hpp"
#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim {

/// Errors of the sensors: assumed, nothing is published.
struct IqSensorErrors {
  bool perfect = false;          ///< readings are the true values: no converter, filter, noise or model
  double volts_gain = 0.002;     ///< relative
  double amps_gain = 0.01;       ///< relative
  double amps_bias = 1;          ///< converter ticks
  double converter_noise = 0.5;  ///< converter ticks, deviation
  double speed_noise = 0.2;      ///< rad/s, deviation
  double speed_filter_hz = 500;
  double controller_noise = 0.05;  ///< °C

  friend bool operator==(const IqSensorErrors&, const IqSensorErrors&) = default;
};

/// What is wrong with the temperatures, by a script of faults: °C added to what the sensors and estimators find.
struct IqHeat {
  double coil = 0;
  double controller = 0;
};

struct IqReadings {
  double speed = 0;  ///< rad/s, by the module's clock: a fast one counts more of its seconds per turn
  double volts = 0, amps = 0, joules = 0;
  double controller_celsius = 0;
  double coil_celsius = 0, stator_celsius = 0;
  double motor_amps = 0;
  double angle = 0;
};

class IqSensors {
 public:
  /// `clock_gain`: relative error of the module's clock, above 0 when it is fast.
  IqSensors(const IqSensorErrors& errors, double clock_gain, std::uint64_t seed) noexcept
      : errors_(errors), clock_rate_(1 + clock_gain), random_(seed) {}

  /// At power-up: the estimators begin at the configured ambient temperature.
  void restart(const IqMemory& memory, const MotorState& truth) noexcept;
  /// The filters' and the model's numbers, out of the memory.
  void tune(const IqMemory& memory) noexcept;
  void step(const MotorState& truth) noexcept;
  void heat(const IqHeat& heat) noexcept { heat_ = heat; }
  /// With perfect sensors `truth` itself, but by the module's clock.
  [[nodiscard]] IqReadings readings(const MotorState& truth) const noexcept;
  /// What sensors and a clock without errors would find.
  [[nodiscard]] IqReadings perfect(const MotorState& truth) const noexcept;

 private:
  void convert(const MotorState& truth) noexcept;
  void model(const MotorState& truth) noexcept;
  void estimate_coil() noexcept;

  struct Model {
    double volts_gain = 0.009, amps_gain = 0.03, amps_bias = 2048;
    double power_filter = 1, controller_filter = 1, speed_filter = 1;
    double resistance = 0.045, torque_constant = 0.0043;
    double ambient = 25, free = 0.05, forced = 0.006, to_stator = 0.25, coil_capacity = 6;
  };
  IqSensorErrors errors_;
  double clock_rate_;  ///< seconds of the module per second
  Random random_;
  Model model_;
  IqHeat heat_;
  IqReadings readings_;
  double joules_at_reset_ = 0;
  double heat_square_ = 0;
  std::uint64_t ticks_ = 0;
};

}  // namespace kphi::sim
