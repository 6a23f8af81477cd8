// The motor, its power stage, its supply and the shaft: physics only, one fixed step of 1/7000 s. The step is the
// implicit midpoint rule for the shaft and backward Euler for the supply's capacitance, both solved in closed form:
// energy is conserved to rounding, however stiff the supply is.
#pragma once

#include <cstdint>
#include <functional>
#include <utility>

#include "base/random.hpp"

namespace kphi::sim {

/// Internal sample rate of the Net Box and step rate of the physics.
inline constexpr int kTicksPerSecond = 7000;
inline constexpr double kTick = 1.0 / kTicksPerSecond;  ///< s

[[nodiscard]] inline double sign_of(double x) noexcept { return x > 0 ? 1.0 : (x < 0 ? -1.0 : 0.0); }

/// What the power stage does during one tick.
struct PowerStage {
  enum class Mode : std::uint8_t {
    coast,  ///< all switches open
    brake,  ///< leads shorted
    drive,  ///< a share `duty` of the supply's voltage across the motor
  };
  Mode mode = Mode::coast;
  double duty = 0;  ///< -1..1
};

/// True state of the motor. SI; + = counter-clockwise.
struct MotorState {
  double speed = 0;          ///< rad/s
  double angle = 0;          ///< rad, [0, 2π)
  double turning_speed = 0;  ///< rad/s, mean of the last tick: motor_amps and drive_volts belong to it
  double drive_volts = 0;    ///< V across the motor
  double motor_amps = 0;
  double supply_volts = 12;  ///< at the module
  double supply_amps = 0;    ///< into the module; negative while the motor feeds back
  double source_amps = 0;    ///< out of the supply, never below 0
  double supply_joules = 0;  ///< into the module
  double coil_celsius = 25;
  double stator_celsius = 25;
  double controller_celsius = 30;
};

/// IQ2306 2200Kv: data sheet values (facts of the 2306) where there are any, otherwise assumed.
struct MotorParameters {
  double torque_constant = 0.0043;     ///< Kt = Ke, N m/A
  double resistance = 0.045;           ///< motor and controller at 25 °C, ohm
  double winding_resistance = 0.038;   ///< the winding's part of it at 25 °C, ohm
  double copper_coefficient = 0.0039;  ///< 1/°C
  double rotor_inertia = 2.5e-6;       ///< kg m², without propeller
  double friction_torque = 6e-4;       ///< Coulomb, N m
  double viscous_friction = 0;         ///< N m/(rad/s)
  double idle_current = 0.06;          ///< A of the electronics
  double supply_volts = 12;
  double source_resistance = 0.020;       ///< supply and leads, ohm
  double supply_current_max = 30;         ///< A; the supply delivers at most this and takes none back
  double supply_foldback = 1;             ///< of the limit, left when the voltage is 0; 1: constant current
  double bus_capacitance = 270e-6;        ///< F
  double coil_capacity = 6;               ///< J/°C
  double coil_free_convection = 0.05;     ///< W/°C
  double coil_forced_convection = 0.006;  ///< W/(°C sqrt(rad/s))
  double coil_to_stator = 0.25;           ///< W/°C
  double stator_capacity = 10;            ///< J/°C
  double stator_convection = 0.08;        ///< W/°C
  double controller_resistance = 0.007;   ///< ohm; what its own heat comes from
  double controller_to_ambient = 8;       ///< °C/W
  double controller_seconds = 60;         ///< time constant
  double controller_own_warmth = 5;       ///< °C of the idling electronics
  double ambient_celsius = 25;
  double turbulence = 0.02;  ///< deviation of the drag torque per tick, relative

  friend bool operator==(const MotorParameters&, const MotorParameters&) = default;
};

/// The load on the shaft.
struct ShaftLoad {
  double drag = 0;     ///< k_Q, N m/(rad/s)²
  double inertia = 0;  ///< kg m²
};

/// Faults outside the module.
struct MotorUpset {
  double supply_volts = 0;  ///< added to the source
  bool locked = false;      ///< the rotor is held
};

/// Another source on the bus: its voltage at the end of a tick in which the module draws `amps` + `siemens` times that
/// voltage.
using BusSource = std::function<double(double amps, double siemens)>;

class Motor {
 public:
  explicit Motor(const MotorParameters& parameters) noexcept;
  void load(const ShaftLoad& load) noexcept { load_ = load; }
  /// From now on `source`, which includes the capacitance, feeds the bus; an upset no longer affects the supply.
  void power(BusSource source) { source_ = std::move(source); }
  void upset(const MotorUpset& upset) noexcept { upset_ = upset; }
  void step(const PowerStage& stage, Random& random) noexcept;
  [[nodiscard]] const MotorState& state() const noexcept { return state_; }
  /// Torque on the mount about +z, N m: the reaction, negative while a positive speed is driven or dragged.
  [[nodiscard]] double reaction_torque() const noexcept { return reaction_torque_; }

 private:
  struct Shaft;
  struct Circuit {
    double amps = 0;        ///< of the motor
    double volts = 0;       ///< of the bus, at the end of the tick
    double resistance = 0;  ///< of the loop that the motor's current takes
  };
  [[nodiscard]] Circuit solve(const PowerStage& stage, const Shaft& shaft) const noexcept;
  [[nodiscard]] double bus_volts(double conductance, double amps) const noexcept;
  void account(const Circuit& circuit, const Shaft& shaft, double next) noexcept;
  void warm() noexcept;

  MotorParameters parameters_;
  ShaftLoad load_;
  MotorUpset upset_;
  BusSource source_;  ///< empty: the supply of the parameters
  MotorState state_;
  double resistance_;          ///< whole loop, now
  double winding_resistance_;  ///< now
  double reaction_torque_ = 0;
  double heat_ = 0;  ///< amps² seconds since the last warming
  std::uint64_t ticks_ = 0;
};

}  // namespace kphi::sim
