#include "daq/guard/observation.hpp"

#include <cmath>
#include <utility>

namespace kphi::daq {

Observation observe(const Readings& newest, Instant now, const Freshness& limit, const Clock& clock) {
  Observation seen{newest};
  const auto seconds_since = [&](results::Nanoseconds at) { return to_seconds(clock.shrunk(now - Instant(at))); };
  seen.load_cell_age = now - Instant(newest.load_cell_ns);
  seen.motor_age = now - Instant(newest.motor_ns);
  seen.load_cell_is_fresh = seen.load_cell_age <= limit.load_cell;
  seen.motor_is_fresh = seen.motor_age <= limit.motor;
  for (const GuardedQuantity& row : kQuantities) {
    const bool too_old = (row.source == Source::load_cell && !seen.load_cell_is_fresh) ||
                         (row.source == Source::motor && !seen.motor_is_fresh);
    if (too_old) seen.judged[row.watched] = kUnknown;
  }
  // Module and supply measure the same voltage at two places.
  if (newest.supply.time_ns != 0)
    seen.judged[Watched::supply_voltage_high] =
        std::fmax(seen.judged[Watched::supply_voltage_low], newest.supply.voltage_v);
  seen.judged[Watched::load_cell_age] = seconds_since(newest.load_cell_ns);
  seen.judged[Watched::motor_age] = seconds_since(newest.motor_ns);
  if (newest.supply.time_ns != 0) seen.judged[Watched::supply_age] = seconds_since(newest.supply.time_ns);
  return seen;
}

void Observer::tell(Watched watched, double value, results::Nanoseconds at) {
  const bool is_lower = row_of(watched).sense == Sense::lower;
  double& shown = newest_.judged[watched];
  const bool is_first = !std::exchange(told_[static_cast<std::size_t>(watched)], true);
  if (is_first || (is_lower ? value < shown : value > shown)) shown = value;
  if (judge_) judge_(watched, value, at);
}

void Observer::take(const results::LoadCellRecord& sample) {
  newest_.load_cell_ns = sample.arrival_ns;
  load_.add(sample);
  for (std::size_t axis = 0; axis < 6; ++axis) tell(static_cast<Watched>(axis), load_.load(axis), sample.arrival_ns);
  if (!load_.full()) return;
  newest_.thrust_n = load_.thrust() - thrust_zero_;
  newest_.torque_nm = mounting_.sign * (load_.shaft_torque() - torque_zero_);
  if (!has_zero_) return;
  tell(Watched::thrust, std::abs(newest_.thrust_n), sample.arrival_ns);
  tell(Watched::shaft_torque, std::abs(newest_.torque_nm), sample.arrival_ns);
}

void Observer::take(const results::MotorReading& reading) {
  using results::MotorChannel;
  newest_.motor_ns = reading.time_ns;
  const double value = reading.value;
  switch (reading.channel) {
    case MotorChannel::speed:
      newest_.speed_rad_s = std::abs(value);
      tell(Watched::speed, to_rpm(RadPerSec(std::abs(value))), reading.time_ns);
      break;
    case MotorChannel::supply_voltage:
      tell(Watched::supply_voltage_low, value, reading.time_ns);
      tell(Watched::supply_voltage_high, value, reading.time_ns);
      break;
    case MotorChannel::supply_current:
      tell(Watched::supply_current, value, reading.time_ns);
      break;
    case MotorChannel::motor_current:
      tell(Watched::motor_current, std::abs(value), reading.time_ns);
      break;
    case MotorChannel::coil_temperature:
      tell(Watched::coil_temperature, value, reading.time_ns);
      break;
    case MotorChannel::fault_now:
      newest_.fault_bits = static_cast<std::uint64_t>(value);
      break;
    case MotorChannel::derate:
      newest_.derate = value;
      break;
    case MotorChannel::drive_pwm:
      newest_.drive_pwm = value;
      break;
    case MotorChannel::drive_mode:
      break;
  }
  speed_.take(reading);
  newest_.judged[Watched::speed_error] = speed_.error_percent();
}

void Observer::take(const results::SupplyReading& reading) {
  newest_.supply = reading;
  tell(Watched::supply_voltage_high, reading.voltage_v, reading.time_ns);
  tell(Watched::output_current, reading.current_a, reading.time_ns);
}

void Observer::take(const results::PhaseMark& mark) noexcept {
  if (mark.phase == results::Phase::step) return speed_.command(Instant(mark.time_ns), RadPerSec(mark.speed_rad_s));
  if (mark.phase == results::Phase::ramp)
    return speed_.command_ramp(Instant(mark.time_ns), RadPerSec(mark.speed_rad_s));
  speed_.release();
  newest_.judged[Watched::speed_error] = kUnknown;
}

void Observer::take_zero(const std::array<double, 6>& mean) noexcept {
  const auto axis = static_cast<std::size_t>(mounting_.axis);
  thrust_zero_ = mounting_.sign * mean[axis];
  torque_zero_ = mean[axis + 3];
  has_zero_ = true;
}

Readings Observer::readings() noexcept {
  told_ = {};
  return newest_;
}

}  // namespace kphi::daq
