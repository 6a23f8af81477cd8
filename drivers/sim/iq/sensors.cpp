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

}  // namespace

void IqSensors::restart(const IqMemory& memory, const MotorState& truth) noexcept {
  tune(memory);
  readings_ = {};
  readings_.coil_celsius = readings_.stator_celsius = model_.ambient;
  readings_.controller_celsius = truth.controller_celsius;
  readings_.volts = truth.supply_volts * (1 + errors_.volts_gain);
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
  if (++ticks_ % kTicksPerEstimate == 0) estimate_coil();
}

IqReadings IqSensors::readings(const MotorState& truth) const noexcept {
  IqReadings out = readings_;
  if (errors_.perfect) {
    out = perfect(truth);
    out.speed /= clock_rate_;
  }
  out.coil_celsius += heat_.coil;
  out.controller_celsius += heat_.controller;
  out.angle = truth.angle;
  return out;
}

IqReadings IqSensors::perfect(const MotorState& truth) const noexcept {
  return {truth.speed,
          truth.supply_volts,
          truth.supply_amps,
          truth.supply_joules - joules_at_reset_,
          truth.controller_celsius,
          truth.coil_celsius,
          truth.stator_celsius,
          truth.motor_amps,
          truth.angle};
}

void IqSensors::convert(const MotorState& truth) noexcept {
  auto& r = readings_;
  constexpr double kTrueVoltsGain = 0.009, kTrueAmpsGain = 0.03, kTrueBias = 2048;
  const auto converted = [this](double ticks) {
    return std::round(std::clamp(ticks + errors_.converter_noise * random_.normal(), 0.0, kConverterTop));
  };
  const double volts = converted(truth.supply_volts * (1 + errors_.volts_gain) / kTrueVoltsGain);
  const double amps =
      converted(truth.supply_amps * (1 + errors_.amps_gain) / kTrueAmpsGain + kTrueBias + errors_.amps_bias);
  r.volts += model_.power_filter * (volts * model_.volts_gain - r.volts);
  r.amps += model_.power_filter * ((amps - model_.amps_bias) * model_.amps_gain - r.amps);
  r.joules += r.volts * r.amps * kTick;
  const double warm = truth.controller_celsius + errors_.controller_noise * random_.normal();
  r.controller_celsius += model_.controller_filter * (warm - r.controller_celsius);
  const double speed = truth.speed / clock_rate_ + errors_.speed_noise * random_.normal();
  r.speed += model_.speed_filter * (speed - r.speed);
}

// The firmware knows the volts that it drives, not the current.
void IqSensors::model(const MotorState& truth) noexcept {
  auto& r = readings_;
  const bool open = truth.motor_amps == 0;
  const double emf = model_.torque_constant * r.speed;
  const double amps = open || model_.resistance <= 0 ? 0 : (truth.drive_volts - emf) / model_.resistance;
  r.motor_amps += model_.speed_filter * (amps - r.motor_amps);
}

void IqSensors::estimate_coil() noexcept {
  constexpr double kInterval = kTicksPerEstimate * kTick;
  auto& r = readings_;
  const double heating = heat_square_ / kTicksPerEstimate * kWindingOhm;
  heat_square_ = 0;
  const double forced = model_.forced * std::sqrt(std::abs(r.speed));
  const double convection = (model_.free + forced) * (r.coil_celsius - model_.ambient);
  const double conduction = model_.to_stator * (r.coil_celsius - r.stator_celsius);
  r.coil_celsius += (heating - convection - conduction) / model_.coil_capacity * kInterval;
  const double stator_lost = kStatorConvection * (r.stator_celsius - model_.ambient);
  r.stator_celsius += (conduction - stator_lost) / kStatorCapacity * kInterval;
}

}  // namespace kphi::sim
