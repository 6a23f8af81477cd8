#include "daq/guard/observation.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kphi::daq {

LoadWatch::LoadWatch(const Mounting& mounting, const results::LoadCellScale& scale)
    : mounting_(mounting),
      counts_per_newton_(scale.counts_per_newton),
      counts_per_newton_metre_(scale.counts_per_newton_metre),
      sums_(static_cast<std::size_t>(std::max(1.0, std::round(kWindow * scale.sample_rate_hz)))) {}

void LoadWatch::add(const LoadCellRecord& record) noexcept {
  last_[samples_++ % last_.size()] = record.counts;
  if (samples_ < last_.size()) return;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const auto [a, b, c] = std::array{last_[0][axis], last_[1][axis], last_[2][axis]};
    median_[axis] = std::max(std::min(a, b), std::min(std::max(a, b), c));
  }
  const auto axis = static_cast<std::size_t>(mounting_.axis);
  Pair& oldest = sums_[medians_++ % sums_.size()];
  total_.thrust += median_[axis] - oldest.thrust;
  total_.torque += median_[axis + 3] - oldest.torque;
  oldest = {median_[axis], median_[axis + 3]};
}

double LoadWatch::load(std::size_t axis) const noexcept {
  return std::abs(static_cast<double>(median_[axis])) / (axis < 3 ? counts_per_newton_ : counts_per_newton_metre_);
}

double LoadWatch::thrust() const noexcept {
  return mounting_.sign * static_cast<double>(total_.thrust) / (static_cast<double>(sums_.size()) * counts_per_newton_);
}

double LoadWatch::shaft_torque() const noexcept {
  return static_cast<double>(total_.torque) / (static_cast<double>(sums_.size()) * counts_per_newton_metre_);
}

Observation observe(const Readings& newest, Instant now, const Freshness& limit, const Clock& clock) {
  Observation seen{newest, limit};
  const auto seconds_since = [&](Nanoseconds at) { return to_seconds(clock.shrunk(now - Instant(at))); };
  seen.load_cell_age = now - Instant(newest.load_cell_ns);
  seen.motor_age = now - Instant(newest.motor_ns);
  for (const GuardedQuantity& row : kQuantities) {
    const bool too_old = (row.source == Source::load_cell && !seen.load_cell_is_fresh()) ||
                         (row.source == Source::motor && !seen.motor_is_fresh());
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

void Observer::tell(Watched watched, double value) {
  const bool is_lower = row_of(watched).sense == Sense::lower;
  double& shown = newest_.judged[watched];
  const bool is_first = !std::exchange(told_[static_cast<std::size_t>(watched)], true);
  if (is_first || (is_lower ? value < shown : value > shown)) shown = value;
  if (judge_) judge_(watched, value);
}

void Observer::take(const LoadCellRecord& sample) {
  newest_.load_cell_ns = sample.arrival_ns;
  load_.add(sample);
  if (vibration_.add(sample.counts, newest_.speed_rad_s)) newest_.vibration = vibration_.newest();
  for (std::size_t axis = 0; axis < 6; ++axis) tell(static_cast<Watched>(axis), load_.load(axis));
  if (!load_.full() || !has_zero_) return;
  newest_.thrust_n = load_.thrust() - thrust_zero_;
  newest_.torque_nm = mounting_.sign * (load_.shaft_torque() - torque_zero_);
  tell(Watched::thrust, std::abs(newest_.thrust_n));
  tell(Watched::shaft_torque, std::abs(newest_.torque_nm));
}

void Observer::take(const MotorReading& reading) {
  newest_.motor_ns = reading.time_ns;
  tell_motor(reading.channel, reading.value);
  speed_.take(reading);
  newest_.judged[Watched::speed_error] = speed_.error_percent();
}

void Observer::tell_motor(MotorChannel channel, double value) {
  switch (channel) {
    case MotorChannel::speed:
      newest_.speed_rad_s = std::abs(value);
      return tell(Watched::speed, to_rpm(RadPerSec(std::abs(value))));
    case MotorChannel::supply_voltage:
      tell(Watched::supply_voltage_low, value);
      return tell(Watched::supply_voltage_high, value);
    case MotorChannel::supply_current:
      return tell(Watched::supply_current, value);
    case MotorChannel::motor_current:
      return tell(Watched::motor_current, std::abs(value));
    case MotorChannel::coil_temperature:
      return tell(Watched::coil_temperature, value);
    case MotorChannel::derate:
      newest_.derate = value;
      return;
    case MotorChannel::drive_mode:
      return;
    case MotorChannel::drive_pwm:
      newest_.drive_pwm = value;
      return;
    case MotorChannel::fault_now:
      newest_.fault_bits = static_cast<std::uint64_t>(value);
      return;
  }
}

void Observer::take(const SupplyReading& reading) {
  newest_.supply = reading;
  tell(Watched::supply_voltage_high, reading.voltage_v);
  tell(Watched::output_current, reading.current_a);
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
