#include "drivers/sim/iq/sensors.hpp"

#include <algorithm>
#include <cmath>

#include "compensation/units.hpp"

namespace kphi::sim {
namespace {

constexpr double kConverterTop = 4095;
constexpr int kTicksPerEstimate = 70;
constexpr double kWindingOhm = 0.038, kStatorCapacity = 10, kStatorConvection = 0.08;  // of the estimator

/// Share of the way that a first-order low-pass goes in one tick.
double share_of(double hertz) noexcept { return hertz > 0 ? 1 - std::exp(-2 * kPi * hertz * kTick) : 1; }

double converted(double ticks) noexcept { return std::round(std::clamp(ticks, 0.0, kConverterTop)); }

}  // namespace

void IqSensors::restart(const IqMemory& memory, const MotorState& truth) noexcept {
  tune(memory);
  readings_ = {};
  readings_.coil_celsius = readings_.stator_celsius = model_.ambient;
  readings_.controller_celsius = truth.controller_celsius;
  readings_.volts = readings_.volts_cascaded = truth.supply_volts * (1 + errors_.volts_gain);
  readings_.amps = truth.supply_amps * (1 + errors_.amps_gain);
  readings_.speed = truth.speed / clock_rate_;
  joules_at_reset_ = truth.supply_joules;
  heat_square_ = 0;
}

void IqSensors::tune(const IqMemory& memory) noexcept {
  model_.volts_gain = memory.finite(69, 9);
  model_.amps_gain = memory.finite(69, 10);
  model_.amps_bias = memory.finite(69, 11);
  model_.power_filter = share_of(memory.value(69, 6));
  model_.cascade_filter = share_of(memory.value(69, 14));
  model_.controller_filter = share_of(memory.value(73, 2));
  model_.speed_filter = share_of(errors_.speed_filter_hz);
  model_.resistance = memory.finite(50, 33);
  const double kv = memory.finite(50, 32);
  model_.torque_constant = kv > 0 ? 60 / (2 * kPi * kv) : 0;
  if (memory.find(83, 2) == nullptr) return;
  model_.ambient = memory.finite(83, 2);
  model_.free = memory.finite(83, 3);
  model_.to_stator = memory.finite(83, 4);
  model_.coil_capacity = std::max(0.1, memory.finite(83, 6));
  model_.forced = memory.finite(83, 7);
}

void IqSensors::step(const MotorState& truth) noexcept {
  if (errors_.perfect) return;
  convert(truth);
  model(truth);
  heat_square_ += readings_.motor_amps * readings_.motor_amps;
  if (++ticks_to_estimate_ == kTicksPerEstimate) {
    ticks_to_estimate_ = 0;
    estimate_coil();
  }
}

void IqSensors::reset_joules(const MotorState& truth) noexcept {
  joules_at_reset_ = truth.supply_joules;
  readings_.joules = 0;
}

IqReadings IqSensors::readings(const MotorState& truth) const noexcept {
  IqReadings out = readings_;
  if (errors_.perfect) {
    out.speed = truth.speed / clock_rate_;
    out.volts = out.volts_cascaded = truth.supply_volts;
    out.amps = truth.supply_amps;
    out.joules = truth.supply_joules - joules_at_reset_;
    out.volts_raw = converted(truth.supply_volts / model_.volts_gain);
    out.amps_raw = converted(truth.supply_amps / model_.amps_gain + model_.amps_bias);
    out.controller_celsius = truth.controller_celsius;
    out.coil_celsius = truth.coil_celsius;
    out.stator_celsius = truth.stator_celsius;
    out.motor_amps = truth.motor_amps;
    out.motor_torque = truth.motor_amps * model_.torque_constant;
    out.emf = truth.speed * model_.torque_constant;
  }
  out.coil_celsius += heat_.coil;
  out.controller_celsius += heat_.controller;
  out.angle = truth.angle;
  return out;
}

void IqSensors::convert(const MotorState& truth) noexcept {
  auto& r = readings_;
  constexpr double kTrueVoltsGain = 0.009, kTrueAmpsGain = 0.03, kTrueBias = 2048;
  const double volts = truth.supply_volts * (1 + errors_.volts_gain) / kTrueVoltsGain;
  const double amps = truth.supply_amps * (1 + errors_.amps_gain) / kTrueAmpsGain + kTrueBias + errors_.amps_bias;
  r.volts_raw = converted(volts + errors_.converter_noise * random_.normal());
  r.amps_raw = converted(amps + errors_.converter_noise * random_.normal());
  r.volts += model_.power_filter * (r.volts_raw * model_.volts_gain - r.volts);
  r.amps += model_.power_filter * ((r.amps_raw - model_.amps_bias) * model_.amps_gain - r.amps);
  r.volts_cascaded += model_.cascade_filter * (r.volts - r.volts_cascaded);
  r.joules += r.volts * r.amps * kTick;
  const double warm = truth.controller_celsius + errors_.controller_noise * random_.normal();
  r.controller_celsius += model_.controller_filter * (warm - r.controller_celsius);
  const double speed = truth.speed / clock_rate_ + errors_.speed_noise * random_.normal();
  r.speed += model_.speed_filter * (speed - r.speed);
}

// The firmware knows the volts that it drives, not the current.
void IqSensors::model(const MotorState& truth) noexcept {
  auto& r = readings_;
  r.emf = model_.torque_constant * r.speed;
  const bool open = truth.motor_amps == 0;
  const double amps = open || model_.resistance <= 0 ? 0 : (truth.drive_volts - r.emf) / model_.resistance;
  r.motor_amps += model_.speed_filter * (amps - r.motor_amps);
  r.motor_torque = r.motor_amps * model_.torque_constant;
}

void IqSensors::estimate_coil() noexcept {
  constexpr double kInterval = kTicksPerEstimate * kTick;
  auto& r = readings_;
  r.joule_watts = heat_square_ / kTicksPerEstimate * kWindingOhm;
  heat_square_ = 0;
  r.forced_convection = model_.forced * std::sqrt(std::abs(r.speed));
  r.convection_watts = (model_.free + r.forced_convection) * (r.coil_celsius - model_.ambient);
  r.conduction_watts = model_.to_stator * (r.coil_celsius - r.stator_celsius);
  r.coil_celsius += (r.joule_watts - r.convection_watts - r.conduction_watts) / model_.coil_capacity * kInterval;
  const double stator_lost = kStatorConvection * (r.stator_celsius - model_.ambient);
  r.stator_celsius += (r.conduction_watts - stator_lost) / kStatorCapacity * kInterval;
}

}  // namespace kphi::sim
