#include "daq/guard/guard.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/real_time.hpp"
#include "daq/bench/device_records.hpp"

namespace kphi::daq {
namespace {

constexpr double kRelayed = 10;  // s that the recorder may be behind
constexpr std::size_t kReadingsRelayed = 16384;
constexpr std::size_t kSupplyReadingsRelayed = 256;
constexpr std::size_t kAtOnce = 1024;
constexpr const char* kDidNotRun = "this computer did not run kphi";
constexpr double kAbsence = 0.05;     // s not run by this computer: long enough to be why a device seems late
constexpr double kAbsenceCounts = 1;  // s after it
constexpr Duration kSecondCheckWall = std::chrono::milliseconds(20);
constexpr double kPatienceAtRest = 0.5;  // s
constexpr double kNoDerate = 0.9999;     // one count of the module's fix16 is 1.5e-5
/// Younger values are shown as present: this computer's own delay, plus three times the device's.
constexpr Duration kFreshWall = std::chrono::milliseconds(60);
constexpr Duration kFreshMotor = std::chrono::milliseconds(100);
/// How late this computer may send a speed and take the reading that answers it; wall time.
Duration host_delay(const profiles::BenchConfig& config) {
  return std::chrono::milliseconds(is_slowed(config) ? 300 : 60);
}

/// Readings from before this run, for example from a pause for a mounting.
template <class Reading, class Link>
void discard(Link& link) {
  std::array<Reading, 64> before_this_run;
  while (link.take(before_this_run) > 0) {
  }
}

double speed_share(const std::vector<GuardLimit>& limits) {
  const auto limit = std::ranges::find(limits, Watched::speed_error, &GuardLimit::watched);
  return limit != limits.end() ? limit->value / 100 : SpeedWatch::kShare;
}

}  // namespace

Guard::Guard(Bench& bench, const profiles::BenchConfig& config, const results::LoadCellScale& scale,
             const std::vector<GuardLimit>& limits, int blades)
    : bench_(bench),
      supply_(config.supply),
      table_(limits),
      observer_({config.thrust_axis, config.thrust_sign, config.iq.spin, blades}, scale,
                SpeedWatch(config.iq.spin, bench.clock().stretched(host_delay(config)), speed_share(limits)),
                [this](Watched watched, double value) { hold(watched, value); }),
      status_watch_(bench.load_cell().box() ? bench.load_cell().box()->kind : netbox::Product::net_box,
                    bench.load_cell().records_together(), scale.sample_rate_hz),
      device_rate_hz_(scale.device_rate_hz),
      saturation_bits_(scale.saturation_bits),
      spin_(config.iq.spin),
      frozen_watch_(scale.sample_rate_hz),
      thrust_watch_(scale.sample_rate_hz),
      fresh_{bench.clock().stretched(kFreshWall) +
                 from_seconds(3 * bench.load_cell().records_together() / scale.sample_rate_hz),
             bench.clock().stretched(kFreshWall) + kFreshMotor},
      samples_(static_cast<std::size_t>(std::max(1024.0, kRelayed * scale.sample_rate_hz)), kAtOnce),
      readings_(kReadingsRelayed, kAtOnce),
      supply_readings_(kSupplyReadingsRelayed, 16),
      polled_ns_(bench.clock().now().count()),
      beat_ns_(polled_ns_.load()),
      recorded_ns_(polled_ns_.load()) {
  for (const GuardLimit& limit : table_) limits_[static_cast<std::size_t>(limit.watched)] = &limit;
  const Instant now = bench.clock().now();
  load_cell_stream_ = {limit_of(Watched::load_cell_age), now};
  motor_stream_ = {limit_of(Watched::motor_age), now};
  supply_stream_ = {bench.supply() != nullptr ? limit_of(Watched::supply_age) : nullptr, now};
  observer_.begin(now);
  shown_.publish(observer_.readings());
  if (bench.supply() != nullptr) discard<SupplyReading>(*bench.supply());
  discard<MotorReading>(bench.motor());
}

void Guard::poll() noexcept {
  try {
    take_marks();
    notice_sleep();  // first: it is the cause of whatever else is found
    notice_absence(bench_.clock().now());
    judge_pause(bench_.clock().now());
    judge_recorder(bench_.clock().now());
    (void)relay();
    shown_.publish(observer_.readings());
    const Instant now = bench_.clock().now();
    judge_links();
    const bool spinning = spinning_;
    for (Stream* stream : {&load_cell_stream_, &motor_stream_, &supply_stream_}) judge_silence(*stream, now, spinning);
    polled_ns_ = now.count();
  } catch (...) {
    bench_.motor().emergency_stop();  // first: there may be no memory for the message
    trip({"the guard failed"});
  }
}

bool Guard::relay() {
  const auto inspect = [this](const auto& each) { judge(each); };
  bool moved = samples_.move(bench_.load_cell(), inspect);
  for (auto& event : bench_.load_cell().take_events()) pending_events_.push_back(std::move(event));
  for (auto& event : bench_.motor().take_events()) pending_events_.push_back(std::move(event));
  for (auto& event : bench_.take_news()) pending_events_.push_back(std::move(event));
  while (!pending_events_.empty() && events_.push(pending_events_.front())) {
    pending_events_.pop_front();
    moved = true;
  }
  moved = readings_.move(bench_.motor(), inspect) || moved;
  return (bench_.supply() != nullptr && supply_readings_.move(*bench_.supply(), inspect)) || moved;
}

void Guard::trip(Trip trip) noexcept {
  if (!judging_ || latch_.trip() != nullptr) return;
  trip.noticed = bench_.clock().now();
  trip.step = step_;
  name_absence(trip);
  if (!latch_.set(std::move(trip))) return;
  bench_.motor().emergency_stop();
  if (bench_.supply() != nullptr) bench_.supply()->cut();
}

/// Written so that NaN trips: a value that cannot be compared is no proof of safety.
void Guard::hold(Watched watched, double value) {
  const GuardLimit* limit = limit_of(watched);
  if (limit == nullptr || (limit->lower ? value >= limit->value : value <= limit->value)) return;
  trip(passed(*limit, value));
}

void Guard::take_marks() {
  results::PhaseMark mark;
  while (marks_.pop(mark)) {
    observer_.take(mark);
    frozen_watch_.learn(mark.phase == results::Phase::zero_before);
    thrust_watch_.begin(RadPerSec(mark.phase == results::Phase::step ? mark.speed_rad_s : 0));
  }
}

void Guard::judge(const LoadCellRecord& sample) {
  load_cell_stream_.newest = Instant(sample.arrival_ns);
  judge_gap(sample);
  judge_status(sample);
  observer_.take(sample);
  judge_trust(sample);
}

/// Except at the end of a range, where a sound cell repeats one value, too.
void Guard::judge_trust(const LoadCellRecord& sample) {
  if ((sample.status & saturation_bits_) != 0) return;
  if (const auto axis = frozen_watch_.take(sample.counts))
    trip({fmt::format("load cell: {} repeats one value, {} samples so far, which its noise in the zero cannot do",
                      kAxisNames[*axis], *frozen_watch_.limit(*axis)),
          Source::load_cell, Watched::frozen});
  if (!observer_.is_settled(sample.arrival_ns)) return;
  if (!thrust_watch_.add(observer_.thrust_n(), observer_.torque_nm())) return;
  if (auto why = thrust_watch_.doubt(spin_, expected_.read()))
    trip({std::move(*why), Source::load_cell, Watched::no_thrust});
}

/// A faulty box stops the run also at rest, since the zeros are taken from these samples; saturation and network
/// trouble stop it only while the motor turns.
void Guard::judge_status(const LoadCellRecord& sample) {
  const StatusWatch::State state = status_watch_.take(sample);
  if (auto event = status_watch_.take_event()) pending_events_.push_back(std::move(*event));
  const bool untrusted = state == StatusWatch::State::untrusted || (state == StatusWatch::State::lasting && spinning_);
  if (untrusted && latch_.trip() == nullptr) trip({status_watch_.reason(), Source::load_cell});
}

void Guard::judge(const MotorReading& reading) {
  motor_stream_.newest = Instant(reading.time_ns);
  observer_.take(reading);
  if (reading.channel == MotorChannel::fault_now && reading.value != 0)
    trip({fmt::format("motor: the module reports a fault (power_safety.fault_now 0x{:02X})",
                      static_cast<unsigned>(reading.value)),
          Source::motor});
  if (reading.channel == MotorChannel::derate && !(reading.value >= kNoDerate))
    trip({fmt::format("motor: the module derates to {:.0f} % of its drive", 100 * reading.value), Source::motor});
  // Last: fault and derating are why the rotor does not follow.
  if (const SpeedError& error = observer_.speed_error(); error.kind != SpeedError::Kind::none)
    trip({to_words(error), Source::motor, Watched::speed_error});
}

void Guard::judge(const SupplyReading& reading) {
  supply_stream_.newest = Instant(reading.time_ns);
  if (!supply_) return;
  if (auto trouble = daq::check(reading, *supply_, observer_.is_settled(reading.time_ns))) trip(std::move(*trouble));
  observer_.take(reading);
}

/// Also when the newest sample is fresh: nothing was judged during a break of the network or of this computer.
void Guard::judge_gap(const LoadCellRecord& sample) {
  const std::optional<std::uint32_t> before = std::exchange(last_sequence_, sample.ft_sequence);
  const GuardLimit* patience = limit_of(Watched::load_cell_age);
  if (!before || !spinning_ || patience == nullptr) return;
  const auto step = static_cast<std::int32_t>(sample.ft_sequence - *before);  // negative: the box started again
  const double missing_s = step / device_rate_hz_;
  if (missing_s <= patience->value) return;
  const GuardLimit limit{Watched::samples_missing, "gap in the load cell's samples", patience->value, "s",
                         patience->source};
  trip(passed(limit, missing_s));
}

void Guard::judge_links() {
  const auto judge = [this](Source source, const std::string& failure) {
    if (!failure.empty()) trip({failure, source, Watched::state, true});
  };
  judge(Source::computer, bench_.unprotected());
  judge(Source::motor, bench_.motor().failure());
  judge(Source::load_cell, bench_.load_cell().failure());
  if (bench_.supply() != nullptr) judge(Source::supply, bench_.supply()->failure());
}

double Guard::wall_seconds_since(std::int64_t at_ns, Instant now) const {
  return to_seconds(bench_.clock().shrunk(now - Instant(at_ns)));
}

void Guard::judge_silence(Stream& stream, Instant now, bool spinning) {
  if (stream.limit == nullptr) return;
  const Clock& clock = bench_.clock();
  const double age = wall_seconds_since(stream.newest.count(), now);
  if (age <= (spinning ? stream.limit->value : std::max(stream.limit->value, kPatienceAtRest))) {
    stream.stale_since = kNever;
    return;
  }
  stream.stale_since = std::min(stream.stale_since, now);
  if (now - stream.stale_since >= clock.stretched(kSecondCheckWall)) trip(passed(*stream.limit, age));
}

void Guard::judge_pause(Instant now) {
  const GuardLimit* limit = limit_of(Watched::pause);
  if (!spinning_ || limit == nullptr) return;
  const double pause = wall_seconds_since(beat_ns_, now);
  if (pause <= limit->value) return;
  Trip found = passed(*limit, pause);
  const double unwatched = wall_seconds_since(polled_ns_, now);
  if (unwatched > limit->value) {
    found.source = Source::computer;
    found.reason = fmt::format("{} for {:.2g} s", kDidNotRun, unwatched);
  }
  trip(std::move(found));
}

void Guard::judge_recorder(Instant now) {
  if (spinning_) hold(Watched::recorder_pause, wall_seconds_since(recorded_ns_, now));
}

std::size_t Guard::take(std::span<LoadCellRecord> out) {
  recorded_ns_ = bench_.clock().now().count();
  return samples_.take(out);
}

/// Of the guard's own thread, or of one that talks to a device.
void Guard::notice_absence(Instant now) noexcept {
  const double absent = std::max(wall_seconds_since(polled_ns_, now), to_seconds(real_time::overdue()));
  const double serial_late = to_seconds(bench_.serial_late());
  if (std::max(absent, serial_late) < kAbsence) return;
  Absence found{now, std::max(absent, serial_late), serial_late > absent};
  const Absence past = absence_.read();
  if (wall_seconds_since(past.ended.count(), now) <= kAbsenceCounts && past.lasted_s > found.lasted_s)
    found = {now, past.lasted_s, past.of_serial};
  absence_.publish(found);
}

/// While this computer is busy with other things, and right after it, a device seems late and a rotor seems to stray
/// without being so. The runner calls this too.
void Guard::name_absence(Trip& trip) const {
  const bool can_be_why = trip.watched == Watched::load_cell_age || trip.watched == Watched::motor_age ||
                          trip.watched == Watched::supply_age || trip.watched == Watched::speed_error ||
                          trip.watched == Watched::samples_missing ||
                          (trip.link_failed && trip.source == Source::motor);
  if (!can_be_why || trip.reason.find(kDidNotRun) != std::string::npos) return;  // or its link has said so
  const Absence absence = absence_.read();
  if (absence.lasted_s < kAbsence) return;
  if (wall_seconds_since(absence.ended.count(), trip.noticed) > kAbsenceCounts) return;
  trip.reason = absence.of_serial != 0
                    ? fmt::format("this computer handed on {:.2g} s late what its serial ports heard; then: {}",
                                  absence.lasted_s, trip.reason)
                    : fmt::format("{} for {:.2g} s; then: {}", kDidNotRun, absence.lasted_s, trip.reason);
  trip.source = Source::computer;
}

void Guard::notice_sleep() noexcept {
  if (has_slept(bench_.clock())) trip(slept(bench_.clock()));
}

void Guard::mark(const results::PhaseMark& mark) {
  step_ = mark.step;
  if (!marks_.push(mark)) throw SafetyStop("the guard has stalled: its queue of marks is full");
}

void Guard::check(bool spinning) {
  notice_sleep();
  const Instant now = bench_.clock().now();
  judge_pause(now);
  judge_recorder(now);
  const double unwatched = wall_seconds_since(polled_ns_, now);
  if (const GuardLimit* limit = limit_of(Watched::pause); spinning && limit != nullptr && unwatched > limit->value)
    trip({fmt::format("the guard was blocked for {:.2g} s while the motor was turning", unwatched)});
  pause_s_ = spinning ? wall_seconds_since(beat_ns_, now) : kUnknown;
  beat_ns_ = now.count();
  spinning_ = spinning;
  latch_.check();
}

Observation Guard::observe(Instant now) const {
  Observation seen = daq::observe(shown_.read(), now, fresh_, bench_.clock());
  seen.judged[Watched::pause] = pause_s_;
  if (!judging_) seen.judged[Watched::speed_error] = kUnknown;
  if (spinning_) seen.judged[Watched::recorder_pause] = wall_seconds_since(recorded_ns_, now);
  seen.account = bench_.load_cell().account();
  return seen;
}

std::optional<StreamEvent> Guard::event() const {
  const Trip* trip = latch_.trip();
  if (trip == nullptr) return std::nullopt;
  const bool of_supply = trip->watched == Watched::state && trip->source == Source::supply;
  const std::string where = trip->step < 0 ? "" : fmt::format("step {}: ", trip->step + 1);
  const EventKind kind = is_load_cell_axis(trip->watched) ? EventKind::range_trip
                         : of_supply                      ? EventKind::supply_stop
                                                          : EventKind::guard_trip;
  return event_at(trip->noticed, kind, where + trip->reason);
}

}  // namespace kphi::daq
