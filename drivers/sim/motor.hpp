// The motor, its velocity control, its supply and the shaft: physics only, one fixed step of 1/7000 s.
#pragma once

#include <array>
#include <cstdint>

#include "drivers/sim/random.hpp"

namespace kphi::sim {

/// Internal sample rate of the Net Box and step rate of the physics.
inline constexpr int kTicksPerSecond = 7000;
inline constexpr double kTick = 1.0 / kTicksPerSecond;  ///< s

/// What the module's firmware asks of the power stage.
struct MotorDrive {
  enum class Mode : std::uint8_t { brake, coast, volts, pwm, velocity };
  Mode mode = Mode::coast;
  double target = 0;                 ///< V, 1 or rad/s, by mode
  double kp = 0, ki = 0, kd = 0;     ///< V/(rad/s), V/rad, V/(rad/s²)
  double ff0 = 0, ff1 = 0, ff2 = 0;  ///< V, V/(rad/s), V/(rad/s)²
  double input_filter_hz = 100;      ///< low-pass on the velocity command
};

/// Everything about the motor that the module can report. SI; + = counter-clockwise.
struct MotorState {
  double speed = 0;        ///< rad/s
  double angle = 0;        ///< rad, [0, 2π)
  double drive_volts = 0;  ///< V across the motor, after limiting
  double motor_amps = 0;
  double supply_volts = 12;  ///< at the module
  double supply_amps = 0;
  double supply_joules = 0;
  double coil_celsius = 25;
  double controller_celsius = 30;
};

/// IQ2306 2200Kv: data sheet values (facts of the 2306) where there are any, otherwise assumed.
struct MotorParameters {
  double torque_constant = 0.0043;    ///< Kt = Ke, N m/A
  double resistance = 0.045;          ///< motor and controller, ohm
  double winding_resistance = 0.038;  ///< ohm
  double current_max = 30;            ///< A
  double rotor_inertia = 2.5e-6;      ///< kg m², without propeller
  double friction_torque = 6e-4;      ///< Coulomb, N m
  double idle_current = 0.06;         ///< A of the electronics
  double supply_volts = 12;
  double source_resistance = 0.020;       ///< supply and leads, ohm
  double supply_current_max = 30;         ///< A; the supply delivers no more and takes none back
  double coil_capacity = 6;               ///< J/°C
  double coil_free_convection = 0.05;     ///< W/°C
  double coil_forced_convection = 0.006;  ///< W/(°C sqrt(rad/s))
  double ambient_celsius = 25;
  double turbulence = 0.02;  ///< deviation of the drag torque per tick, relative
};

/// The load on the shaft.
struct ShaftLoad {
  double drag = 0;     ///< k_Q, N m/(rad/s)²
  double inertia = 0;  ///< kg m²
};

class Motor {
 public:
  explicit Motor(const MotorParameters& parameters) noexcept;
  void load(const ShaftLoad& load) noexcept { load_ = load; }
  void step(const MotorDrive& drive, Random& random) noexcept;
  [[nodiscard]] const MotorState& state() const noexcept { return state_; }
  /// Torque on the mount about +z, N m: the reaction, negative while a positive speed is driven or dragged.
  [[nodiscard]] double reaction_torque() const noexcept { return reaction_torque_; }
  [[nodiscard]] const MotorParameters& parameters() const noexcept { return parameters_; }

 private:
  [[nodiscard]] double demanded_volts(const MotorDrive& drive) noexcept;
  void drive_with(double volts) noexcept;
  void turn(Random& random) noexcept;
  void warm() noexcept;

  MotorParameters parameters_;
  ShaftLoad load_;
  MotorState state_;
  double filtered_target_ = 0;
  double integral_ = 0;  ///< of the speed error, V
  double last_speed_ = 0;
  double reaction_torque_ = 0;
  std::uint32_t ticks_to_warming_ = 0;
};

}  // namespace kphi::sim
