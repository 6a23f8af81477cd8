#include "daq/guard.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daq/awake.hpp"
#include "daq/supply_interlock.hpp"

namespace kphi::daq {
namespace {

constexpr double kRelayed = 10;  // s that the recorder may be behind
constexpr std::size_t kReadingsRelayed = 16384;
constexpr std::size_t kSupplyReadingsRelayed = 256;
constexpr std::size_t kAtOnce = 1024;
constexpr Duration kSecondLookWall = std::chrono::milliseconds(20);
constexpr double kPatienceAtRest = 0.5;  // s
constexpr double kNoDerate = 0.9999;     // one count of the module's fix16 is 1.5e-5
/// How late this host may tell a speed and take the reading that answers it; wall time.
Duration host_delay(const profiles::Bench& place) { return std::chrono::milliseconds(is_slowed(place) ? 300 : 60); }

Mounting mounting_of(const profiles::Bench& place) { return {place.thrust_axis, place.thrust_sign, place.iq.spin}; }

std::size_t samples_relayed(const results::LoadCellScale& scale) {
  return static_cast<std::size_t>(std::max(1024.0, kRelayed * scale.sample_rate_hz));
}

/// What waits from before this run, from a pause for a mounting for example.
template <class Reading>
void leave_out(BenchStreams& devices) {
  std::array<Reading, 64> before_this_run;
  while (devices.take(before_this_run) > 0) {
  }
}

double speed_share(const std::vector<GuardLimit>& limits) {
  for (const GuardLimit& limit : limits) {
    if (limit.watched == Watched::speed_error) return limit.value / 100;
  }
  return SpeedWatch::kShare;
}

}  // namespace

Guard::Guard(Bench& bench, const profiles::Bench& place, const results::LoadCellScale& scale,
             const std::vector<GuardLimit>& limits)
    : bench_(bench),
      devices_(bench),
      mounting_(mounting_of(place)),
      supply_(place.supply),
      table_(limits),
      load_(mounting_, scale),
      status_watch_(bench.load_cell().configuration().kind, bench.load_cell().configuration().records_per_datagram,
                    scale.sample_rate_hz),
      speed_watch_(place.iq.spin, bench.clock().stretched(host_delay(place)), speed_share(limits)),
      device_rate_hz_(scale.device_rate_hz),
      samples_(samples_relayed(scale), kAtOnce),
      readings_(kReadingsRelayed, kAtOnce),
      supply_readings_(kSupplyReadingsRelayed, 16),
      looked_ns_(bench.clock().now().count()),
      beat_ns_(looked_ns_.load()) {
  for (const GuardLimit& limit : table_) limits_[static_cast<std::size_t>(limit.watched)] = &limit;
  const Instant now = bench.clock().now();
  load_cell_stream_ = {limit_of(Watched::load_cell_age), now};
  motor_stream_ = {limit_of(Watched::motor_age), now};
  supply_stream_ = {bench.supply() != nullptr ? limit_of(Watched::supply_age) : nullptr, now};
  leave_out<results::SupplyReading>(devices_);
  leave_out<results::MotorReading>(devices_);
}

void Guard::look() noexcept {
  try {
    take_marks();
    notice_sleep();  // first: it is the cause of whatever else is found
    judge_pause(bench_.clock().now());
    (void)relay();
    const Instant now = bench_.clock().now();
    judge_links();
    const bool spinning = spinning_;
    for (Stream* stream : {&load_cell_stream_, &motor_stream_, &supply_stream_}) judge_silence(*stream, now, spinning);
    looked_ns_ = now.count();
  } catch (...) {
    bench_.motor().emergency_stop();  // before words, for which there may be no memory
    trip_state("the guard failed");
  }
}

bool Guard::relay() {
  const auto take = [this](auto out) { return devices_.take(out); };
  const auto look = [this](auto batch) {
    for (const auto& each : batch) judge(each);
  };
  bool moved = samples_.move(take, look);
  for (auto& event : devices_.take_events()) pending_events_.push_back(std::move(event));
  while (!pending_events_.empty() && events_.push(pending_events_.front())) {
    pending_events_.pop_front();
    moved = true;
  }
  moved = readings_.move(take, look) || moved;
  return supply_readings_.move(take, look) || moved;
}

std::vector<results::StreamEvent> Guard::take_events() {
  std::vector<results::StreamEvent> taken;
  events_.consume_all([&](const results::StreamEvent& event) { taken.push_back(event); });
  return taken;
}

void Guard::trip(Trip trip) noexcept {
  if (!judging_ || latch_.trip() != nullptr) return;
  trip.noticed = bench_.clock().now();
  trip.step = step_;
  if (!latch_.set(std::move(trip))) return;
  bench_.motor().emergency_stop();
  if (bench_.supply() != nullptr) bench_.supply()->cut();
}

void Guard::trip_state(const std::string& reason, Instant sample) noexcept {
  Trip state;
  state.reason = reason;
  state.sample = sample;
  trip(std::move(state));
}

Trip Guard::of_speed(const SpeedError& error, Instant sample) const {
  Trip strays;
  strays.reason = to_words(error);
  strays.watched = Watched::speed_error;
  strays.value = 100 * std::abs((error.measured - error.commanded) / error.commanded);
  if (const GuardLimit* limit = limit_of(Watched::speed_error)) strays.limit = *limit;
  strays.sample = sample;
  return strays;
}

/// Written so that NaN trips: a value that cannot be compared is no proof of safety.
void Guard::hold(Watched watched, double value, results::Nanoseconds at) {
  const GuardLimit* limit = limit_of(watched);
  if (limit == nullptr || (limit->lower ? value >= limit->value : value <= limit->value)) return;
  trip(passed(*limit, value, Instant(at)));
}

void Guard::take_marks() {
  results::PhaseMark mark;
  while (marks_.pop(mark)) {
    if (mark.phase == results::Phase::step) {
      speed_watch_.command(Instant(mark.time_ns), RadPerSec(mark.speed_rad_s));
    } else if (mark.phase == results::Phase::ramp) {
      speed_watch_.command_ramp(Instant(mark.time_ns), RadPerSec(mark.speed_rad_s));
    } else {
      speed_watch_.release();
    }
  }
}

void Guard::judge(const results::LoadCellRecord& sample) {
  load_cell_stream_.newest = Instant(sample.arrival_ns);
  judge_gap(sample);
  judge_status(sample);
  load_.add(sample);
  for (std::size_t axis = 0; axis < 6; ++axis) hold(static_cast<Watched>(axis), load_.load(axis), sample.arrival_ns);
  if (!has_zero_ || !load_.full()) return;
  hold(Watched::thrust, std::abs(load_.thrust() - thrust_zero_), sample.arrival_ns);
  hold(Watched::shaft_torque, std::abs(load_.shaft_torque() - torque_zero_), sample.arrival_ns);
}

/// A faulty box stops the run also at rest, since the zeros are taken from these samples; saturation and trouble with
/// a network may pass until the motor turns.
void Guard::judge_status(const results::LoadCellRecord& sample) {
  const StatusWatch::State state = status_watch_.take(sample);
  if (auto event = status_watch_.take_event()) pending_events_.push_back(std::move(*event));
  const bool untrusted = state == StatusWatch::State::untrusted || (state == StatusWatch::State::lasting && spinning_);
  if (untrusted && latch_.trip() == nullptr) trip_state(status_watch_.reason(), Instant(sample.arrival_ns));
}

void Guard::judge(const results::MotorReading& reading) {
  using results::MotorChannel;
  motor_stream_.newest = Instant(reading.time_ns);
  const double value = reading.value;
  switch (reading.channel) {
    case MotorChannel::speed:
      hold(Watched::speed, to_rpm(RadPerSec(std::abs(value))), reading.time_ns);
      break;
    case MotorChannel::supply_voltage:
      hold(Watched::supply_voltage_low, value, reading.time_ns);
      hold(Watched::supply_voltage_high, value, reading.time_ns);
      break;
    case MotorChannel::supply_current:
      hold(Watched::supply_current, value, reading.time_ns);
      break;
    case MotorChannel::motor_current:
      hold(Watched::motor_current, std::abs(value), reading.time_ns);
      break;
    case MotorChannel::coil_temperature:
      hold(Watched::coil_temperature, value, reading.time_ns);
      break;
    case MotorChannel::fault_now:
      if (value != 0)
        trip_state(fmt::format("motor: the module reports a fault (power_safety.fault_now 0x{:02X})",
                               static_cast<unsigned>(value)),
                   Instant(reading.time_ns));
      break;
    case MotorChannel::derate:
      if (!(value >= kNoDerate))
        trip_state(fmt::format("motor: the module derates to {:.0f} % of its drive", 100 * value),
                   Instant(reading.time_ns));
      break;
    case MotorChannel::drive_mode:
    case MotorChannel::drive_pwm:
      break;
  }
  // Last: fault and derating say why the rotor does not follow.
  speed_watch_.take(reading);
  if (speed_watch_.error().kind != SpeedError::Kind::none)
    trip(of_speed(speed_watch_.error(), Instant(reading.time_ns)));
}

void Guard::judge(const results::SupplyReading& reading) {
  supply_stream_.newest = Instant(reading.time_ns);
  if (!supply_) return;
  if (const auto trouble = daq::check(reading, *supply_, reading.time_ns >= settled_from_))
    trip_state(trouble->reason, Instant(reading.time_ns));
  hold(Watched::supply_voltage_high, reading.voltage_v, reading.time_ns);
  hold(Watched::output_current, reading.current_a, reading.time_ns);
}

/// Also when the newest sample is fresh: after a break of the network or of this computer nobody saw what happened.
void Guard::judge_gap(const results::LoadCellRecord& sample) {
  const std::optional<std::uint32_t> before = std::exchange(last_sequence_, sample.ft_sequence);
  const GuardLimit* patience = limit_of(Watched::load_cell_age);
  if (!before || !spinning_ || patience == nullptr) return;
  const auto step = static_cast<std::int32_t>(sample.ft_sequence - *before);  // negative: the box started again
  const double missing_s = step / device_rate_hz_;
  if (missing_s <= patience->value) return;
  const GuardLimit limit{Watched::samples_missing, "gap in the load cell's samples", patience->value, "s",
                         patience->source};
  trip(passed(limit, missing_s, Instant(sample.arrival_ns)));
}

void Guard::judge_links() {
  for (const std::string& failure : {bench_.motor().failure(), bench_.load_cell().failure(),
                                     bench_.supply() != nullptr ? bench_.supply()->failure() : std::string()}) {
    if (!failure.empty()) trip_state(failure);
  }
}

void Guard::judge_silence(Stream& stream, Instant now, bool spinning) {
  if (stream.limit == nullptr) return;
  const Clock& clock = bench_.clock();
  const double age = to_seconds(clock.shrunk(now - stream.newest));
  if (age <= (spinning ? stream.limit->value : std::max(stream.limit->value, kPatienceAtRest))) {
    stream.stale_since = kNever;
    return;
  }
  stream.stale_since = std::min(stream.stale_since, now);
  if (now - stream.stale_since >= clock.stretched(kSecondLookWall)) trip(passed(*stream.limit, age, stream.newest));
}

void Guard::judge_pause(Instant now) {
  const GuardLimit* limit = limit_of(Watched::pause);
  if (!spinning_ || limit == nullptr) return;
  const Instant beat(beat_ns_);
  const double pause = to_seconds(bench_.clock().shrunk(now - beat));
  if (pause <= limit->value) return;
  Trip found = passed(*limit, pause, beat);
  const double unwatched = to_seconds(bench_.clock().shrunk(now - Instant(looked_ns_)));
  if (unwatched > limit->value) found.reason = fmt::format("this computer did not run kphi for {:.2g} s", unwatched);
  trip(std::move(found));
}

void Guard::notice_sleep() noexcept {
  if (has_slept(bench_.clock())) trip(slept(bench_.clock()));
}

void Guard::mark(const results::PhaseMark& mark) {
  step_ = mark.step;
  if (!marks_.push(mark)) throw SafetyStop("the guard takes no more marks: it stands still");
}

void Guard::take_zero(const netbox::ZeroMeasurement& zero) noexcept {
  const auto axis = static_cast<std::size_t>(mounting_.axis);
  thrust_zero_ = mounting_.sign * zero.mean[axis];
  torque_zero_ = zero.mean[axis + 3];
  has_zero_ = true;
}

void Guard::check(bool spinning) {
  notice_sleep();
  const Instant now = bench_.clock().now();
  judge_pause(now);
  const double unwatched = to_seconds(bench_.clock().shrunk(now - Instant(looked_ns_)));
  if (const GuardLimit* limit = limit_of(Watched::pause); spinning && limit != nullptr && unwatched > limit->value)
    trip_state(fmt::format("the guard was blocked for {:.2g} s while the motor was turning", unwatched));
  beat_ns_ = now.count();
  spinning_ = spinning;
  latch_.check();
}

std::optional<results::StreamEvent> Guard::event() const {
  using results::EventKind;
  const Trip* trip = latch_.trip();
  if (trip == nullptr) return std::nullopt;
  const bool of_range = trip->watched <= Watched::torque_z;
  const bool of_supply = trip->reason.starts_with("supply:");
  const std::string where = trip->step < 0 ? "" : fmt::format("step {}: ", trip->step + 1);
  return results::StreamEvent{of_range    ? EventKind::range_trip
                              : of_supply ? EventKind::supply_stop
                                          : EventKind::guard_trip,
                              trip->noticed.count(), 0,
                              fmt::format("{:.3f} s: {}{}", to_seconds(trip->noticed), where, trip->reason)};
}

}  // namespace kphi::daq
