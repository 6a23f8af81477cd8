#include "drivers/sim/physics/motor.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/units.hpp"

namespace kphi::sim {
namespace {

constexpr int kTicksPerWarming = 70;  // heat is slow: every 10 ms

}  // namespace

/// One tick of the shaft before the motor's torque is known.
struct Motor::Shaft {
  double speed = 0;
  double inertia = 0;
  double drag = 0;             // N m, against the turn by sign
  double friction = 0;         // N m, the same
  double friction_torque = 0;  // N m, what friction can hold
  bool locked = false;

  /// Change of the mean speed of the tick per torque of the motor.
  [[nodiscard]] double yielding() const noexcept { return locked ? 0 : 0.5 * kTick / inertia; }
  /// Mean speed of the tick without the motor's torque.
  [[nodiscard]] double free_speed() const noexcept {
    return locked ? 0.5 * speed : speed - (drag + friction) * yielding();
  }
  [[nodiscard]] double next(double torque) const noexcept {
    if (locked) return 0;
    const double pulled = speed + (torque - drag) / inertia * kTick;
    const double held = friction_torque / inertia * kTick;
    if (std::abs(pulled) <= held) return 0;
    return pulled - sign_of(pulled) * held;
  }
};

Motor::Motor(const MotorParameters& parameters) noexcept
    : parameters_(parameters), resistance_(parameters.resistance), winding_resistance_(parameters.winding_resistance) {
  state_.supply_volts = parameters.supply_volts - parameters.idle_current * parameters.source_resistance;
  state_.supply_amps = state_.source_amps = parameters.idle_current;
  state_.coil_celsius = state_.stator_celsius = parameters.ambient_celsius;
  state_.controller_celsius = parameters.ambient_celsius + parameters.controller_own_warmth;
}

void Motor::step(const PowerStage& stage, Random& random) noexcept {
  Shaft shaft;
  shaft.speed = state_.speed;
  shaft.inertia = parameters_.rotor_inertia + load_.inertia;
  shaft.drag = load_.drag * shaft.speed * std::abs(shaft.speed) * (1 + parameters_.turbulence * random.normal()) +
               parameters_.viscous_friction * shaft.speed;
  shaft.friction_torque = parameters_.friction_torque;
  shaft.friction = sign_of(shaft.speed) * parameters_.friction_torque;
  shaft.locked = upset_.locked;

  const Circuit circuit = solve(stage, shaft);
  const double next = shaft.next(parameters_.torque_constant * circuit.amps);
  account(circuit, shaft, next);

  reaction_torque_ = -(shaft.inertia * (next - shaft.speed) * kTicksPerSecond + shaft.drag);
  state_.speed = next;
  state_.angle += state_.turning_speed * kTick;
  if (state_.angle >= 2 * kPi) state_.angle -= 2 * kPi;
  if (state_.angle < 0) state_.angle += 2 * kPi;
  if (++ticks_ % kTicksPerWarming == 0) warm();
}

// With the mean speed u = u0 + y Kt I of the tick: R I = V - Ke u. V is 0 when braking, d times the bus otherwise, and
// the bus gives d I + idle: linear in I and the bus's voltage.
Motor::Circuit Motor::solve(const PowerStage& stage, const Shaft& shaft) const noexcept {
  const double k = parameters_.torque_constant;
  const double emf = k * shaft.free_speed();
  Circuit circuit;
  circuit.resistance = stage.mode == PowerStage::Mode::brake ? winding_resistance_ : resistance_;
  const double yielding = circuit.resistance + k * k * shaft.yielding();
  if (stage.mode != PowerStage::Mode::drive) {
    circuit.volts = bus_volts(0, 0);
    if (stage.mode == PowerStage::Mode::brake) circuit.amps = -emf / yielding;
    return circuit;
  }
  circuit.volts = bus_volts(stage.duty * stage.duty / yielding, -stage.duty * emf / yielding);
  circuit.amps = (stage.duty * circuit.volts - emf) / yielding;
  return circuit;
}

/// Voltage of the bus when the motor draws `conductance` times it plus `amps`: while the supply conducts, or cannot
/// give more, or is overrun and blocks.
double Motor::bus_volts(double conductance, double amps) const noexcept {
  if (source_) return source_(amps + parameters_.idle_current, conductance);
  const double capacitance = parameters_.bus_capacitance * kTicksPerSecond;
  const double source = parameters_.supply_volts + upset_.supply_volts;
  const double resistance = parameters_.source_resistance;
  const double left = capacitance + conductance;
  const double given = capacitance * state_.supply_volts - amps - parameters_.idle_current;
  const double conducting = (given + source / resistance) / (left + 1 / resistance);
  if (conducting > source) return std::max(0.0, given / left);
  const double most = parameters_.supply_current_max;
  const double share = (1 - parameters_.supply_foldback) * most / std::max(source, 1.0);
  if ((source - conducting) / resistance <= most * parameters_.supply_foldback + share * conducting) return conducting;
  return std::max(0.0, (given + most * parameters_.supply_foldback) / (left - share));
}

void Motor::account(const Circuit& circuit, const Shaft& shaft, double next) noexcept {
  const double mean = 0.5 * (shaft.speed + next);
  const double volts = circuit.amps * circuit.resistance + parameters_.torque_constant * mean;
  const double module_amps = volts * circuit.amps / std::max(circuit.volts, 1e-3) + parameters_.idle_current;
  const double charging = parameters_.bus_capacitance * (circuit.volts - state_.supply_volts) * kTicksPerSecond;

  heat_ += circuit.amps * circuit.amps * kTick;
  state_.turning_speed = mean;
  state_.drive_volts = volts;
  state_.motor_amps = circuit.amps;
  state_.supply_volts = circuit.volts;
  state_.supply_amps = module_amps;
  state_.source_amps = source_ ? module_amps : module_amps + charging;
  state_.supply_joules += circuit.volts * module_amps * kTick;
}

void Motor::warm() noexcept {
  constexpr double kInterval = kTicksPerWarming * kTick;
  const auto& p = parameters_;
  const double square = heat_ / kInterval;  // mean of the current's square
  heat_ = 0;
  const double convection = p.coil_free_convection + p.coil_forced_convection * std::sqrt(std::abs(state_.speed));
  const double conducted = p.coil_to_stator * (state_.coil_celsius - state_.stator_celsius);
  const double lost = convection * (state_.coil_celsius - p.ambient_celsius);
  const double stator_lost = p.stator_convection * (state_.stator_celsius - p.ambient_celsius);
  state_.coil_celsius += (square * winding_resistance_ - lost - conducted) / p.coil_capacity * kInterval;
  state_.stator_celsius += (conducted - stator_lost) / p.stator_capacity * kInterval;
  const double controller_target =
      p.ambient_celsius + p.controller_own_warmth + p.controller_to_ambient * p.controller_resistance * square;
  state_.controller_celsius += (controller_target - state_.controller_celsius) * kInterval / p.controller_seconds;
  const double warmth = p.copper_coefficient * (state_.coil_celsius - 25);
  winding_resistance_ = p.winding_resistance * (1 + warmth);
  resistance_ = p.resistance + p.winding_resistance * warmth;
}

}  // namespace kphi::sim
