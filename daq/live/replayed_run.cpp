#include "daq/live/replayed_run.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <thread>

#include "daq/load_watch.hpp"
#include "profiles/configuration_error.hpp"

namespace kphi::daq::live {
namespace {

using results::MotorChannel;
using results::Phase;
using Wall = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kTickWall{10};
constexpr Duration kFresh = std::chrono::milliseconds(200);

const char* words_of(Phase phase) {
  switch (phase) {
    case Phase::zero_before:
    case Phase::zero_after:
      return "zero";
    case Phase::spin_down:
      return "spin down";
    case Phase::bias_before:
    case Phase::bias_settling:
    case Phase::bias_after:
      return "bias";
    case Phase::ramp:
      return "ramp";
    case Phase::step:
    case Phase::end:
      break;
  }
  return "";
}

void take(const results::MotorReading& reading, Observation& seen) {
  if (reading.channel == MotorChannel::speed) seen.speed = RadPerSec(std::abs(reading.value));
  if (reading.channel == MotorChannel::supply_voltage) seen.module_voltage = Volts(reading.value);
  if (reading.channel == MotorChannel::supply_current) seen.supply_current = Amperes(reading.value);
  if (reading.channel == MotorChannel::motor_current) seen.motor_current = Amperes(reading.value);
  if (reading.channel == MotorChannel::coil_temperature) seen.coil_temperature = Celsius(reading.value);
  if (reading.channel == MotorChannel::derate) seen.derate = reading.value;
  if (reading.channel == MotorChannel::fault_now) seen.fault_bits = static_cast<unsigned>(reading.value);
}

/// One that cannot be read any more limits nothing.
profiles::Bench bench_of(const results::RunHeader& header) {
  try {
    return profiles::parse_bench(header.bench_text, "bench of the run");
  } catch (const ConfigurationError&) {
    return {};
  }
}

}  // namespace

Subject subject_of(const results::RunRecording& recording) {
  const results::RunHeader& header = recording.header;
  Subject subject;
  try {
    const DeviceLimits devices = device_limits(header);
    subject =
        subject_of(profiles::parse_campaign(header.campaign_text, "campaign of the run"), bench_of(header), &devices);
  } catch (const ConfigurationError&) {
    subject.name = header.campaign_name;
    subject.propeller = header.propeller_name;
    subject.minimum_discard = Seconds(header.minimum_discard_s);
    for (const auto& mark : recording.phases)
      subject.speed_max_rpm = std::max(subject.speed_max_rpm, to_rpm(RadPerSec(mark.speed_rad_s)));
  }
  subject.replay = true;
  std::erase_if(subject.limits, [](const LimitBar& bar) { return bar.watched == Watched::pause; });  // not recorded
  return subject;
}

ReplayedRun::ReplayedRun(const results::RunRecording& recording, ManualClock& clock)
    : recording_(recording), clock_(clock), motor_(recording.motor) {
  std::stable_sort(motor_.begin(), motor_.end(), [](const auto& a, const auto& b) { return a.time_ns < b.time_ns; });
  const auto& cell = recording.load_cell;
  if (!cell.empty()) {
    begin_ = Instant(cell.front().arrival_ns);
    end_ = Instant(cell.back().arrival_ns);
  }
  for (std::size_t i = 0; i + 1 < recording.phases.size(); ++i) {
    const auto& mark = recording.phases[i];
    if (mark.phase != Phase::zero_before) continue;
    const auto at = [&](results::Nanoseconds time) {
      return static_cast<std::size_t>(
          std::lower_bound(cell.begin(), cell.end(), time,
                           [](const auto& record, results::Nanoseconds t) { return record.arrival_ns < t; }) -
          cell.begin());
    };
    for (std::size_t axis = 0; axis < 6; ++axis)
      zero_[axis] = mean_counts(axis, at(mark.time_ns), at(recording.phases[i + 1].time_ns));
  }
  position_.propeller = recording.header.propeller_id;
  position_.occlusion_deg = recording.header.occlusion_deg;
  position_.repetition = position_.repetitions = recording.header.repetition;
  for (const auto& mark : recording.phases) position_.steps = std::max(position_.steps, mark.step + 1);
  seen_.account = recording.account;
}

double ReplayedRun::mean_counts(std::size_t axis, std::size_t from, std::size_t to) const {
  if (from >= to) return 0;
  double sum = 0;
  for (std::size_t i = from; i < to; ++i) sum += recording_.load_cell[i].counts[axis];
  return sum / static_cast<double>(to - from);
}

void ReplayedRun::observe(Instant when) {
  const auto& header = recording_.header;
  const auto& cell = recording_.load_cell;
  const std::size_t from = sample_;
  while (sample_ < cell.size() && cell[sample_].arrival_ns <= when.count()) ++sample_;
  if (sample_ > from) {
    const auto axis = static_cast<std::size_t>(header.thrust_axis);
    const auto above_zero = [&](std::size_t of) { return mean_counts(of, from, sample_) - zero_[of]; };
    seen_.thrust = Newtons(header.thrust_sign * above_zero(axis) / header.load_cell.counts_per_newton);
    seen_.torque = NewtonMetres(header.thrust_sign * above_zero(3 + axis) / header.load_cell.counts_per_newton_metre);
    seen_.loads = borne_loads(std::span(cell).subspan(from, sample_ - from), header.load_cell.counts_per_newton,
                              header.load_cell.counts_per_newton_metre);
    seen_.account.received = sample_;
  }
  for (; reading_ < motor_.size() && motor_[reading_].time_ns <= when.count(); ++reading_)
    take(motor_[reading_], seen_);
  const auto& supply = recording_.supply;
  for (; supply_ < supply.size() && supply[supply_].time_ns <= when.count(); ++supply_) seen_.supply = supply[supply_];
  seen_.load_cell_age = sample_ > 0 ? when - Instant(cell[sample_ - 1].arrival_ns) : when - begin_;
  seen_.motor_age = reading_ > 0 ? when - Instant(motor_[reading_ - 1].time_ns) : when - begin_;
  seen_.load_cell_is_fresh = seen_.load_cell_age <= kFresh;
  seen_.motor_is_fresh = reading_ > 0 && seen_.motor_age <= kFresh;
}

void ReplayedRun::tell_phases(Instant when, Progress& progress) {
  for (; phase_ < recording_.phases.size() && recording_.phases[phase_].time_ns <= when.count(); ++phase_) {
    if (position_.step >= 0) progress.step_done(position_, seen_);
    const auto& mark = recording_.phases[phase_];
    position_.step = mark.step;
    position_.phase = words_of(mark.phase);
    position_.commanded = RadPerSec(mark.speed_rad_s);
  }
  for (; event_ < recording_.events.size() && recording_.events[event_].time_ns <= when.count(); ++event_) {
    const auto& event = recording_.events[event_];
    progress.say((is_of_motor(event.kind) ? "motor: " : "") + event.text);
  }
}

void ReplayedRun::show(Instant when, Progress& progress, double speed) {
  tell_phases(when, progress);
  observe(when);
  clock_.set(when);
  position_.remaining_s = to_seconds(std::max(Duration(0), end_ - when)) / speed;
  progress.tick(position_, seen_);
}

bool play(const results::RunRecording& recording, ManualClock& clock, Progress& progress, double speed,
          const std::function<bool()>& stop_asked) {
  ReplayedRun run(recording, clock);
  const auto began = Wall::now();
  for (auto due = began;; due += kTickWall) {
    std::this_thread::sleep_until(due);
    if (stop_asked()) return false;
    const Instant when = run.begin() + from_seconds(std::chrono::duration<double>(Wall::now() - began).count() * speed);
    run.show(std::min(when, run.end()), progress, speed);
    if (when >= run.end()) return true;
  }
}

}  // namespace kphi::daq::live
