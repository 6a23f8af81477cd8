#include "daq/recorder.hpp"

#include <fmt/format.h>

#include <cmath>

#include "daq/device_records.hpp"
#include "daq/load_watch.hpp"

namespace kphi::daq {
namespace {

constexpr std::size_t kRecordsAtOnce = 7000;
constexpr std::size_t kReadingsAtOnce = 512;
/// What is younger is shown as what is: this host's own delay, and three times that of the device.
constexpr Duration kFreshWall = std::chrono::milliseconds(60);
constexpr Duration kFreshMotor = std::chrono::milliseconds(100);
constexpr std::array kAxes{"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

results::EventKind kind_of(netbox::RangeVerdict verdict) {
  return verdict == netbox::RangeVerdict::near ? results::EventKind::near_range : results::EventKind::beyond_range;
}

}  // namespace

Recorder::Recorder(Bench& bench, Streams& streams, results::RunWriter& writer, const Mounting& mounting,
                   const results::LoadCellScale& scale)
    : bench_(bench),
      streams_(streams),
      writer_(writer),
      mounting_(mounting),
      scale_(to_configuration(scale)),
      watch_(scale_),
      fresh_load_cell_(bench.clock().stretched(kFreshWall) +
                       from_seconds(3 * bench.load_cell().configuration().records_per_datagram / scale.sample_rate_hz)),
      fresh_motor_(bench.clock().stretched(kFreshWall) + kFreshMotor),
      next_sync_(bench.clock().now() + bench.sync_interval()),
      records_(kRecordsAtOnce),
      readings_(kReadingsAtOnce),
      load_cell_ns_(bench.clock().now().count()),
      motor_ns_(bench.clock().now().count()) {}

void Recorder::drain() noexcept {
  if (failed_.load(std::memory_order_relaxed)) return;
  try {
    drain_marks();
    drain_load_cell();
    drain_events();
    drain_motor();
    drain_supply();
    if (const Instant now = bench_.clock().now(); now >= next_sync_) {
      writer_.sync();
      next_sync_ = now + bench_.sync_interval();
    }
  } catch (...) {
    failure_ = std::current_exception();
    failed_.store(true, std::memory_order_release);
  }
}

void Recorder::drain_marks() {
  results::PhaseMark mark;
  while (marks_.pop(mark)) {
    writer_.mark(mark);
    phase_sum_n_ = phase_sum_nm_ = 0;
    phase_count_ = 0;
    measuring_ = mark.phase == results::Phase::bias_before || mark.phase == results::Phase::bias_after ||
                 mark.phase == results::Phase::zero_before;
    estimate_ = {};
  }
}

void Recorder::drain_events() {
  for (const results::StreamEvent& event : streams_.take_events()) note(event);
}

void Recorder::note(const results::StreamEvent& event) {
  writer_.note(event);
  events_.push(event);  // a full queue: nobody listens, and the file has it
}

void Recorder::look_at(std::span<const results::LoadCellRecord> batch) {
  for (const results::LoadCellRecord& record : batch) {
    const netbox::StampedRecord stamped = to_stamped(record);
    // That it is too much for the cell is the guard's to say.
    const netbox::RangeVerdict verdict = std::min(watch_.look(stamped.record), netbox::RangeVerdict::beyond);
    if (verdict > worst_) note_range(verdict, record.arrival_ns);
    if (measuring_) estimate_.add(stamped);
  }
  if (measuring_) measured_.publish(estimate_.result(scale_));
}

void Recorder::note_range(netbox::RangeVerdict verdict, results::Nanoseconds at) {
  worst_ = verdict;
  const auto axis = static_cast<std::size_t>(watch_.worst_axis());
  const std::string load = fmt::format("{} carries {:.0f} % of its range of {:g} {}", kAxes[axis],
                                       100 * watch_.largest_load(), scale_.range[axis], axis < 3 ? "N" : "N m");
  note({kind_of(verdict), at, 0, fmt::format("{:.3f} s: {}", 1e-9 * static_cast<double>(at), load)});
}

void Recorder::drain_load_cell() {
  while (const std::size_t n = streams_.take(records_)) {
    const std::span<const results::LoadCellRecord> batch(records_.data(), n);
    writer_.append(batch);
    look_at(batch);
    std::int64_t sum = 0, torque_sum = 0;
    const auto axis = static_cast<std::size_t>(mounting_.axis);
    for (const auto& record : batch) {
      sum += record.counts[axis];
      torque_sum += record.counts[3 + axis];
    }
    const double newtons = mounting_.sign * static_cast<double>(sum) / scale_.counts_per_newton;
    const double newton_metres = mounting_.sign * static_cast<double>(torque_sum) / scale_.counts_per_newton_metre;
    phase_sum_n_ += newtons;
    phase_sum_nm_ += newton_metres;
    phase_count_ += n;
    thrust_n_ = newtons / static_cast<double>(n);
    torque_nm_ = newton_metres / static_cast<double>(n);
    phase_mean_n_ = phase_sum_n_ / static_cast<double>(phase_count_);
    phase_mean_nm_ = phase_sum_nm_ / static_cast<double>(phase_count_);
    loads_.publish(borne_loads(batch, scale_.counts_per_newton, scale_.counts_per_newton_metre));
    load_cell_ns_ = batch.back().arrival_ns;
  }
}

void Recorder::drain_motor() {
  using results::MotorChannel;
  while (const std::size_t n = streams_.take(readings_)) {
    const std::span<const results::MotorReading> batch(readings_.data(), n);
    writer_.append(batch);
    for (const auto& reading : batch) {
      if (reading.channel == MotorChannel::speed) speed_rad_s_ = std::abs(reading.value);
      if (reading.channel == MotorChannel::supply_voltage) module_voltage_v_ = reading.value;
      if (reading.channel == MotorChannel::motor_current) motor_current_a_ = reading.value;
      if (reading.channel == MotorChannel::drive_pwm) drive_pwm_ = reading.value;
      if (reading.channel == MotorChannel::derate) derate_ = reading.value;
      if (reading.channel == MotorChannel::fault_now) fault_bits_ = static_cast<unsigned>(reading.value);
      if (reading.channel == MotorChannel::supply_current) supply_current_a_ = reading.value;
      if (reading.channel == MotorChannel::coil_temperature) coil_temperature_degc_ = reading.value;
    }
    motor_ns_ = batch.back().time_ns;
  }
}

void Recorder::drain_supply() {
  while (const std::size_t n = streams_.take(supply_readings_)) {
    writer_.append(std::span<const results::SupplyReading>(supply_readings_.data(), n));
    supply_.publish(supply_readings_[n - 1]);
  }
}

void Recorder::mark(const results::PhaseMark& mark) {
  // The queue holds more marks than a run has; it can only be full when nobody drains it.
  if (!marks_.push(mark)) throw std::runtime_error("recorder: nobody takes the marks of the run");
}

std::vector<results::StreamEvent> Recorder::take_events() {
  std::vector<results::StreamEvent> taken;
  events_.consume_all([&](const results::StreamEvent& event) { taken.push_back(event); });
  return taken;
}

void Recorder::take_zero() noexcept {
  zero_n_ = phase_mean_n_.load();
  zero_nm_ = phase_mean_nm_.load();
}

Observation Recorder::observe(Instant now) const noexcept {
  Observation seen{RadPerSec(speed_rad_s_),         Newtons(thrust_n_ - zero_n_), Amperes(supply_current_a_),
                   Celsius(coil_temperature_degc_), now - Instant(load_cell_ns_), now - Instant(motor_ns_)};
  seen.torque = NewtonMetres(torque_nm_ - zero_nm_);
  seen.derate = derate_;
  seen.fault_bits = fault_bits_;
  seen.module_voltage = Volts(module_voltage_v_);
  seen.motor_current = Amperes(motor_current_a_);
  seen.loads = loads_.read();
  seen.supply = supply_.read();
  seen.account = bench_.load_cell().account();
  seen.load_cell_is_fresh = seen.load_cell_age <= fresh_load_cell_;
  seen.motor_is_fresh = seen.motor_age <= fresh_motor_;
  return seen;
}

void Recorder::check_failure() {
  if (failed_.load(std::memory_order_acquire)) std::rethrow_exception(failure_);
}

}  // namespace kphi::daq
