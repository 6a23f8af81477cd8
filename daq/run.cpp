#include "daq/run.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <optional>

#include "daq/box_bias.hpp"
#include "daq/box_configuration.hpp"
#include "daq/device_records.hpp"
#include "daq/interrupt.hpp"
#include "daq/load_cell_audit.hpp"
#include "daq/recorder.hpp"
#include "daq/spin.hpp"
#include "daq/supply_interlock.hpp"
#include "drivers/device_error.hpp"
#include "results/run_writer.hpp"
#include "results/version.hpp"

namespace kphi::daq {
namespace {

using results::Phase;

constexpr Duration kTickWall = std::chrono::milliseconds(10);
constexpr Duration kPatienceWall = std::chrono::milliseconds(500);
constexpr Duration kSupplyPatienceWall = std::chrono::seconds(2);  // it is asked eight times per second
// While the motor turns. Seen twice: after this host has stood still, what waits in the sockets is taken in between.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
constexpr Duration kSpinPatienceWall = kPatienceWall;  // an instrumented bench is many times slower
#else
constexpr Duration kSpinPatienceWall = std::chrono::milliseconds(145);
#endif
constexpr Duration kSecondLookWall = std::chrono::milliseconds(20);
// A program that was stopped for this long must not go on: the module may have let its motor coast meanwhile.
constexpr Duration kLongestPauseWall = std::chrono::milliseconds(400);
constexpr double kStandstillRadPerSec = 5.0;
constexpr double kAnySpeed = 1e4;  // rad/s
constexpr double kSpinDownLimitSeconds = 30.0;
constexpr Duration kBiasWorksWall = std::chrono::milliseconds(100);  // what was on its way still has the old zero
constexpr Duration kExplanationWall = std::chrono::seconds(3);       // the box is asked over HTTP for 2 s
constexpr Duration kAftermath = std::chrono::seconds(3);
constexpr Duration kLastLookWall = std::chrono::milliseconds(500);  // at a supply whose output is off
constexpr int kBiasAttempts = 3;
constexpr int kReadings = 2;  // of the box's configuration at the end; a page may be lost
constexpr int kLinesOfEvents = 10;

/// The box has been asked why it is silent, or is so no more.
bool explains_silence(results::EventKind kind) {
  using results::EventKind;
  return kind == EventKind::stolen || kind == EventKind::rdt_disabled || kind == EventKind::unreachable ||
         kind == EventKind::unusable || kind == EventKind::resumed;
}

results::RunHeader header_of(const RunOrder& order, Bench& bench, const results::LoadCellScale& scale) {
  const auto& [campaign, place, occlusion_deg, repetition, remaining, file] = order;
  results::RunHeader header;
  header.started_utc = utc_text(bench.clock(), bench.clock().now());
  // A name-based UUID: unique by campaign, place in it and time, and reproducible on the deterministic bench.
  const std::string name = fmt::format("{}\n{}\n{}\n{}", campaign.text, file.filename().string(), header.started_utc,
                                       bench.clock().now().count());
  header.uuid = boost::uuids::to_string(boost::uuids::name_generator_sha1(boost::uuids::ns::oid())(name));
  header.tool_version = kVersion;
  header.campaign_name = campaign.name;
  header.campaign_text = campaign.text;
  header.bench_text = place.text;
  header.operator_name = campaign.operator_name;
  header.propeller_id = campaign.propeller.id;
  header.propeller_name = campaign.propeller.name;
  header.diameter_in = campaign.propeller.diameter_in;
  header.blades = campaign.propeller.blades;
  header.occlusion_deg = occlusion_deg;
  header.repetition = repetition;
  header.thrust_axis = place.thrust_axis;
  header.thrust_sign = place.thrust_sign;
  header.spin = place.iq.spin;
  header.minimum_discard_s = campaign.minimum_discard.value();
  header.load_cell = scale;
  header.motor_identity = bench.motor().identity();
  if (bench.supply() != nullptr) header.supply_identity = bench.supply()->identity();
  if (const auto air = bench.air()) {
    header.air_density_kg_m3 = air->kg_m3;
    header.air_density_u_kg_m3 = air->u_kg_m3;
  }
  header.motor_parameters = bench.motor().parameters().text();
  return header;
}

/// Steps through the phases of one run.
class Sequence {
 public:
  Sequence(Bench& bench, Recorder& recorder, const RunOrder& order, Progress& progress,
           const std::function<bool()>& stop_asked)
      : bench_(bench), recorder_(recorder), order_(order), progress_(progress), stop_asked_(stop_asked) {
    position_.propeller = order.campaign.propeller.id;
    position_.occlusion_deg = order.occlusion_deg;
    position_.repetition = order.repetition;
    position_.repetitions = order.campaign.repetitions;
    position_.steps = order.campaign.profile.steps;
    begin_ = bench.clock().now();
    end_ = begin_ + from_seconds(order.remaining_bench_s);
  }

  void run() {
    wait_for_standstill();
    if (order_.campaign.box_bias) take_box_bias();
    hold_zero(Phase::zero_before);
    require_rest();
    recorder_.take_zero();
    spin_through_the_steps();
    wait_for_standstill();
    hold_zero(Phase::zero_after);
    recorder_.mark(Phase::end, -1, RadPerSec(0));
  }

  [[nodiscard]] const results::BoxBias& box_bias() const { return box_bias_; }
  [[nodiscard]] const std::optional<iq::StopReport>& stop() const { return stop_; }
  /// What the supply did that stopped the run.
  [[nodiscard]] const std::optional<results::StreamEvent>& supply_event() const { return supply_event_; }

  /// After the motor was let go: what became of it, and what its module says of the cause; empty when it never turned,
  /// or that is told already.
  std::string aftermath() {
    if (bench_.supply() != nullptr) return power_off();
    if (!has_spun_ || stop_) return {};
    iq::StopSettings settings;
    settings.limit = kAftermath;
    bench_.motor().begin_stop(settings);
    const Instant give_up = bench_.clock().now() + 4 * kAftermath;
    std::string cause;
    while (bench_.clock().now() < give_up) {
      for (const results::StreamEvent& event : recorder_.take_events()) {
        if (cause.empty() && is_of_motor(event.kind) && ends_a_run(event.kind)) cause = "; " + event.text;
      }
      if ((stop_ = bench_.motor().stop_report())) return cause + "; " + stop_->summary();
      bench_.wait_until(bench_.clock().now() + bench_.clock().stretched(kTickWall));
    }
    return cause + "; nobody knows whether the motor coasts";
  }

  /// Without power nothing turns, and the module can tell nothing more. A supply that has tripped says so even when the
  /// module, which starved, was heard first.
  std::string power_off() {
    const Instant since = bench_.clock().now();
    const std::string why = bench_.supply()->switch_off();
    if (!why.empty()) return supply_event_ && supply_event_->text.ends_with(why) ? "" : "; " + why;
    const Instant give_up = bench_.clock().now() + bench_.clock().stretched(kLastLookWall);
    while (recorder_.supply().time_ns < since.count() && bench_.clock().now() < give_up)
      bench_.wait_until(bench_.clock().now() + bench_.clock().stretched(kTickWall));
    const results::SupplyReading seen = recorder_.supply();
    const bool tripped = seen.protection != results::SupplyProtection::none;
    if (!tripped || supply_event_) return "; the supply's output is off";
    note_supply(tripped_words(seen));
    return "; " + supply_event_->text;
  }

  /// After the stream has ended, and nobody drains any more.
  void compare_configuration(int attempts) {
    const auto event = configuration_event(
        bench_.load_cell().configuration(), box_bias_.records > 0, [&] { return bench_.load_cell().page(); },
        [&] { return bench_.clock().now(); }, attempts);
    if (!event) return;
    recorder_.note(*event);
    progress_.say("load cell: " + event->text);
  }

  /// After a stop: when the load cell has fallen silent, why, as far as the box tells; else empty.
  std::string explanation() {
    const Instant since = bench_.clock().now();
    const auto stretched = [&](Duration wall) { return bench_.clock().stretched(wall); };
    if (recorder_.observe(since).load_cell_age < stretched(kSpinPatienceWall) / 2) return {};
    if (!standstill_.empty()) return "; " + standstill_;
    while (bench_.clock().now() < since + stretched(kExplanationWall) && !stop_asked_()) {
      for (const results::StreamEvent& event : recorder_.take_events()) {
        if (explains_silence(event.kind)) return "; " + event.text;
      }
      bench_.wait_until(bench_.clock().now() + stretched(kTickWall));
    }
    return {};
  }

 private:
  void take_box_bias() {
    const netbox::ZeroMeasurement before = measure(Phase::bias_before);
    if (const auto why = unrest(before)) throw DeviceError("Net Box", "take the bias", *why, kZeroNextMove);
    // The box takes one noisy sample as its zero: a bad draw is drawn again.
    for (int attempt = 1;; ++attempt) {
      set_box_bias();
      const netbox::ZeroMeasurement after = measure(Phase::bias_after);
      box_bias_ = to_bias(before, after);
      const auto remains = beyond_zero(after);
      if (!remains) return;
      if (attempt == kBiasAttempts) throw DeviceError("Net Box", "take the bias", *remains, kZeroNextMove);
    }
  }

  void set_box_bias() {
    recorder_.mark(Phase::bias_settling, -1, RadPerSec(0));
    bench_.load_cell().set_bias();
    const netbox::Configuration& box = bench_.load_cell().configuration();
    hold(bench_.clock().stretched(kBiasWorksWall) + from_seconds(3 * box.records_per_datagram / box.rdt_rate_hz),
         nullptr);
  }

  netbox::ZeroMeasurement measure(Phase phase) {
    position_.phase = "bias";
    recorder_.mark(phase, -1, RadPerSec(0));
    hold(from_seconds(order_.campaign.zero.value()), nullptr);
    progress_.step_done(position_, seen_);
    return recorder_.measured();
  }

  void spin_through_the_steps() {
    Spin spin(bench_.motor(), order_.place.iq.spin);
    has_spun_ = true;
    int step = 0;
    for (const RadPerSec level : order_.campaign.profile.levels()) {
      position_.step = step;
      position_.commanded = level;
      change_speed();
      spin.at(level);
      recorder_.mark(Phase::step, step, level);
      hold(from_seconds(order_.campaign.profile.dwell.value()), &spin);
      progress_.step_done(position_, seen_);
      ++step;
    }
    position_.step = -1;
    position_.commanded = RadPerSec(0);
    position_.phase = "spin down";
    recorder_.mark(Phase::spin_down, -1, RadPerSec(0));
    change_speed();
    iq::StopSettings stop;
    // What a ramp feeds back raises the voltage of a bench supply, which cannot sink it, until its protection trips.
    if (bench_.supply() != nullptr) stop.coast_below = kAnySpeed;
    spin.begin_stop(stop);
    while (!(stop_ = spin.stopped())) hold(bench_.clock().stretched(kTickWall), &spin);
    if (!stop_->safe()) throw SafetyStop(stop_->summary());
  }

  void change_speed() { settled_from_ = bench_.clock().now() + from_seconds(order_.campaign.minimum_discard.value()); }

  void hold_zero(Phase phase) {
    position_.phase = "zero";
    recorder_.mark(phase, -1, RadPerSec(0));
    hold(from_seconds(order_.campaign.zero.value()), nullptr);
    progress_.step_done(position_, seen_);
  }

  /// Nothing turns while the cell is not at rest: the zero would be worth nothing, and all that is measured against it.
  void require_rest() {
    while (!seen_.load_cell_is_fresh) hold(bench_.clock().stretched(kTickWall), nullptr);  // check() ends this
    const auto axis = static_cast<std::size_t>(order_.place.thrust_axis);
    const double deviation = recorder_.measured().standard_deviation[axis];
    if (deviation <= kNoisyZero) return;
    throw DeviceError(
        "Net Box", "take the zero",
        fmt::format("F{} is noisy: deviation {:.3g} N where {:g} N are tolerated", "xyz"[axis], deviation, kNoisyZero),
        kZeroNextMove);
  }

  void wait_for_standstill() {
    position_.phase = "spin down";
    const Instant give_up = bench_.clock().now() + from_seconds(kSpinDownLimitSeconds);
    // First a reading that is younger than the coast.
    hold(bench_.clock().stretched(20 * kTickWall), nullptr);
    while (recorder_.observe(bench_.clock().now()).speed.value() > kStandstillRadPerSec) {
      if (bench_.clock().now() > give_up) {
        throw SafetyStop(fmt::format("the motor coasts but still turns at {:.0f} RPM after {:.0f} s",
                                     to_rpm(recorder_.observe(bench_.clock().now()).speed), kSpinDownLimitSeconds));
      }
      hold(bench_.clock().stretched(kTickWall), nullptr);
    }
  }

  void hold(Duration duration, Spin* spin) {
    const Instant until = bench_.clock().now() + duration;
    for (Instant now = bench_.clock().now(); now < until; now = bench_.clock().now()) {
      bench_.wait_until(std::min(until, now + bench_.clock().stretched(kTickWall)));
      tick(spin);
    }
  }

  void tick(Spin* spin) {
    if (stop_asked_()) throw Interrupted("stopped by request");
    recorder_.check_failure();
    tell_events();
    if (const auto trip = recorder_.range_trip()) throw SafetyStop("load cell: " + *trip);
    for (const std::string& failure : {bench_.motor().failure(), bench_.load_cell().failure()}) {
      if (!failure.empty()) throw SafetyStop(failure);
    }
    const Instant now = bench_.clock().now();
    if (spin && spun_at_ != kNever && now - spun_at_ > bench_.clock().stretched(kLongestPauseWall)) {
      throw SafetyStop(fmt::format("this program stood still for {:.2g} s while the motor turned",
                                   to_seconds(bench_.clock().shrunk(now - spun_at_))));
    }
    spun_at_ = spin ? now : kNever;
    seen_ = recorder_.observe(now);
    if (const auto trip = check(seen_, order_.campaign.limits)) throw SafetyStop(trip->reason);
    check_ages_at(now, spin != nullptr);
    watch_supply(now);
    if (spin) spin->renew();
    position_.remaining_s = to_seconds(bench_.clock().shrunk(std::max(Duration(0), end_ - now)));
    progress_.tick(position_, seen_);
  }

  void watch_supply(Instant now) {
    if (bench_.supply() == nullptr) return;
    const std::string why = supply_trouble(now);
    if (why.empty()) return;
    note_supply(why);
    throw SafetyStop(why);
  }

  /// Why the supply must stop the bench; empty: it need not.
  [[nodiscard]] std::string supply_trouble(Instant now) const {
    if (std::string failure = bench_.supply()->failure(); !failure.empty()) return failure;
    const results::SupplyReading seen = recorder_.supply();
    const bool any = seen.time_ns != 0;
    const Instant last = any ? Instant(seen.time_ns) : begin_;
    if (now - last > bench_.clock().stretched(kSupplyPatienceWall))
      return fmt::format("supply: no reading for {:.3g} s", to_seconds(bench_.clock().shrunk(now - last)));
    if (!any || !order_.place.supply) return {};
    const auto trip = check(seen, *order_.place.supply, seen.time_ns >= settled_from_.count());
    return trip ? trip->reason : std::string();
  }

  void note_supply(const std::string& what) {
    const std::int64_t at = bench_.clock().now().count();
    const std::string where = position_.step < 0 ? "" : fmt::format("step {}: ", position_.step + 1);
    supply_event_ = {results::EventKind::supply_stop, at, 0,
                     fmt::format("{:.3f} s: {}{}", 1e-9 * static_cast<double>(at), where, what)};
  }

  void check_ages_at(Instant now, bool spinning) {
    const auto stretched = [&](Duration wall) { return bench_.clock().stretched(wall); };
    const auto trip = check_ages(seen_, stretched(spinning ? kSpinPatienceWall : kPatienceWall));
    if (!trip) {
      stale_since_ = kNever;
      return;
    }
    stale_since_ = std::min(stale_since_, now);
    if (now - stale_since_ >= stretched(kSecondLookWall)) throw SafetyStop(trip->reason);
  }

  void tell_events() {
    for (const results::StreamEvent& event : recorder_.take_events()) {
      if (event.kind == results::EventKind::stalled) standstill_ = event.text;
      if (event.kind == results::EventKind::stall_ended) standstill_.clear();
      const std::string line = (is_of_motor(event.kind) ? "motor: " : "load cell: ") + event.text;
      if (told_ < kLinesOfEvents) progress_.say(line);
      if (++told_ == kLinesOfEvents) progress_.say("what else happens in this run is in its file: kphi info");
      if (ends_a_run(event.kind)) throw SafetyStop(line);
    }
  }

  Bench& bench_;
  Recorder& recorder_;
  const RunOrder& order_;
  Progress& progress_;
  const std::function<bool()>& stop_asked_;
  Position position_;
  Observation seen_;
  Instant begin_{};
  Instant settled_from_{};  ///< until then a change of speed may load the supply as it likes
  Instant stale_since_ = kNever;
  Instant spun_at_ = kNever;  ///< the last tick, if the motor turned
  Instant end_{};
  int told_ = 0;
  std::string standstill_;  ///< of the box's measurement, as told; empty while it measures
  results::BoxBias box_bias_;
  bool has_spun_ = false;
  std::optional<iq::StopReport> stop_;
  std::optional<results::StreamEvent> supply_event_;
};

/// Streams while it lives.
class Streaming {
 public:
  explicit Streaming(LoadCellLink& cell) : cell_(cell), scale_(cell.start()) {}
  ~Streaming() { cell_.stop(); }
  Streaming(const Streaming&) = delete;
  Streaming& operator=(const Streaming&) = delete;
  [[nodiscard]] const results::LoadCellScale& scale() const { return scale_; }

 private:
  LoadCellLink& cell_;
  results::LoadCellScale scale_;
};

/// A box that was set otherwise since it was read last must still suit the campaign. Throws ConfigurationError.
void judge_changes(const netbox::Configuration& before, const LoadCellLink& cell, const RunOrder& order,
                   Progress& progress) {
  const netbox::Changes changes = changes_since(before, cell.configuration(), order.campaign.box_bias);
  if (changes == 0) return;
  progress.say("load cell: the box is configured otherwise than when it was read last: " + netbox::to_words(changes) +
               "; this run is recorded with its present scale");
  refuse_unsuitable(cell, order.campaign, order.place);
}

std::string what(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "unknown";
  }
}

bool is_interrupted(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const Interrupted&) {
    return true;
  } catch (...) {
    return false;
  }
}

/// What went wrong, with what is known besides. Keeps the type of the exception, but for a DeviceError.
[[noreturn]] void rethrow_with(const std::exception_ptr& cause, const std::string& more) {
  try {
    std::rethrow_exception(cause);
  } catch (const Interrupted& e) {
    throw Interrupted(e.what() + more);
  } catch (const SafetyStop& e) {
    throw SafetyStop(e.what() + more);
  } catch (const results::RecordError& e) {
    throw results::RecordError(e.what() + more);
  } catch (const DeviceError& e) {
    throw SafetyStop(e.what() + more);  // the device was there; what it refuses in the middle of a run stops the run
  }
}

}  // namespace

std::string utc_text(const Clock& clock, Instant when) {
  const auto seconds = std::chrono::time_point_cast<std::chrono::seconds>(
      clock.epoch_utc() + std::chrono::duration_cast<std::chrono::system_clock::duration>(clock.shrunk(when)));
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)));
}

RunResult record_run(Bench& bench, const RunOrder& order, Progress& progress, const std::function<bool()>& stop_asked) {
  const netbox::Configuration before = bench.load_cell().configuration();
  std::optional<Streaming> streaming(std::in_place, bench.load_cell());
  judge_changes(before, bench.load_cell(), order, progress);
  results::RunWriter writer(order.file, header_of(order, bench, streaming->scale()), bench.files());
  Recorder recorder(bench, writer, {order.place.thrust_axis, order.place.thrust_sign, order.place.iq.spin},
                    streaming->scale());
  Sequence sequence(bench, recorder, order, progress, stop_asked);
  std::exception_ptr cause;
  std::string explanation, aftermath;
  {
    const auto draining = bench.keep_calling([&] { recorder.drain(); });
    try {
      sequence.run();
    } catch (...) {
      cause = std::current_exception();  // the motor coasts since the Spin has gone
      if (bench.supply() != nullptr) bench.supply()->cut();
      explanation = sequence.explanation();
      aftermath = sequence.aftermath();
    }
  }
  streaming.reset();
  recorder.drain();
  if (const auto& event = sequence.supply_event()) recorder.note(*event);
  if (!cause) {
    try {
      recorder.check_failure();
      sequence.compare_configuration(kReadings);
    } catch (...) {
      cause = std::current_exception();
    }
  }
  if (cause && explanation.empty() && !is_interrupted(cause)) {
    try {
      sequence.compare_configuration(1);  // units that changed can look like a limit that was passed
    } catch (const results::RecordError&) {
    }
  }
  const results::SampleAccount account = bench.load_cell().account();
  results::RunEnding ending{results::Outcome::complete, "", account, bench.load_cell().health(), sequence.box_bias()};
  if (!cause) return {order.file, writer.finish(ending), account, sequence.stop()};

  ending.outcome = results::Outcome::aborted;
  ending.outcome_reason = what(cause) + explanation + aftermath;
  try {
    (void)writer.finish(ending);
  } catch (const results::RecordError&) {
    // The first cause matters more; the .part file stays as it was secured last.
  }
  rethrow_with(cause, fmt::format("{}{}; recorded so far: {}", explanation, aftermath, writer.path().string()));
}

}  // namespace kphi::daq
