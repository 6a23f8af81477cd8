#include "daq/run.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <optional>

#include "daq/air.hpp"
#include "daq/box_bias.hpp"
#include "daq/interrupt.hpp"
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
constexpr Duration kSupplyPatienceWall = std::chrono::seconds(2);  // it is asked four times per second
constexpr double kStandstillRadPerSec = 5.0;
constexpr double kSpinDownLimitSeconds = 30.0;
constexpr Duration kBiasWorksWall = std::chrono::milliseconds(100);  // what was on its way still has the old zero
constexpr Duration kExplanationWall = std::chrono::seconds(3);       // the box is asked over HTTP for 2 s
constexpr int kBiasAttempts = 3;
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
  if (place.ambient) {
    const ambient::Density air = density_of(*place.ambient);
    header.air_density_kg_m3 = air.kg_m3;
    header.air_density_u_kg_m3 = air.u_kg_m3;
  }
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
    recorder_.take_zero();
    spin_through_the_steps();
    wait_for_standstill();
    hold_zero(Phase::zero_after);
    recorder_.mark(Phase::end, -1, RadPerSec(0));
  }

  [[nodiscard]] const results::BoxBias& box_bias() const { return box_bias_; }

  /// After a stop: when the load cell has fallen silent, why, as far as the box tells; else empty.
  std::string explanation() {
    const Instant since = bench_.clock().now();
    const auto stretched = [&](Duration wall) { return bench_.clock().stretched(wall); };
    if (recorder_.observe(since).load_cell_age < stretched(kPatienceWall) / 2) return {};
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
    if (const auto why = unrest(before)) throw DeviceError("Net Box", "take the bias", *why, kBiasNextMove);
    // The box takes one noisy sample as its zero: a bad draw is drawn again.
    for (int attempt = 1;; ++attempt) {
      set_box_bias();
      const netbox::ZeroMeasurement after = measure(Phase::bias_after);
      box_bias_ = to_bias(before, after);
      const auto remains = beyond_zero(after);
      if (!remains) return;
      if (attempt == kBiasAttempts) throw DeviceError("Net Box", "take the bias", *remains, kBiasNextMove);
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
    int step = 0;
    for (const RadPerSec level : order_.campaign.profile.levels()) {
      position_.step = step;
      position_.commanded = level;
      spin.at(level);
      recorder_.mark(Phase::step, step, level);
      hold(from_seconds(order_.campaign.profile.dwell.value()), &spin);
      progress_.step_done(position_, seen_);
      ++step;
    }
    position_.step = -1;
    position_.commanded = RadPerSec(0);
    recorder_.mark(Phase::spin_down, -1, RadPerSec(0));
  }

  void hold_zero(Phase phase) {
    position_.phase = "zero";
    recorder_.mark(phase, -1, RadPerSec(0));
    hold(from_seconds(order_.campaign.zero.value()), nullptr);
    progress_.step_done(position_, seen_);
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
    seen_ = recorder_.observe(now);
    if (auto trip = check(seen_, order_.campaign.limits, bench_.clock().stretched(kPatienceWall))) {
      throw SafetyStop(trip->reason);
    }
    watch_supply(now);
    if (spin) spin->renew();
    position_.remaining_s = to_seconds(bench_.clock().shrunk(std::max(Duration(0), end_ - now)));
    progress_.tick(position_, seen_);
  }

  void watch_supply(Instant now) {
    if (bench_.supply() == nullptr) return;
    if (const std::string failure = bench_.supply()->failure(); !failure.empty()) throw SafetyStop(failure);
    const results::SupplyReading seen = recorder_.supply();
    const bool any = seen.time_ns != 0;
    const Instant last = any ? Instant(seen.time_ns) : begin_;
    if (now - last > bench_.clock().stretched(kSupplyPatienceWall))
      throw SafetyStop(fmt::format("supply: no reading for {:.3g} s", to_seconds(now - last)));
    if (!any || !order_.place.supply) return;
    if (const auto trip = check(seen, *order_.place.supply)) throw SafetyStop(trip->reason);
  }

  void tell_events() {
    for (const results::StreamEvent& event : recorder_.take_events()) {
      if (told_ < kLinesOfEvents) progress_.say("load cell: " + event.text);
      if (++told_ == kLinesOfEvents)
        progress_.say("load cell: what else happens in this run is in its file: kphi info");
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
  Instant end_{};
  int told_ = 0;
  results::BoxBias box_bias_;
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

std::string what(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const std::exception& e) {
    return e.what();
  } catch (...) {
    return "unknown";
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
  std::optional<Streaming> streaming(std::in_place, bench.load_cell());
  results::RunWriter writer(order.file, header_of(order, bench, streaming->scale()), bench.files());
  Recorder recorder(bench, writer, {order.place.thrust_axis, order.place.thrust_sign}, streaming->scale());
  Sequence sequence(bench, recorder, order, progress, stop_asked);
  std::exception_ptr cause;
  std::string explanation;
  {
    const auto draining = bench.keep_calling([&] { recorder.drain(); });
    try {
      sequence.run();
    } catch (...) {
      cause = std::current_exception();  // the motor coasts since the Spin has gone
      if (bench.supply() != nullptr) bench.supply()->cut();
      explanation = sequence.explanation();
    }
  }
  streaming.reset();
  recorder.drain();
  if (!cause) {
    try {
      recorder.check_failure();
    } catch (...) {
      cause = std::current_exception();
    }
  }
  const results::SampleAccount account = bench.load_cell().account();
  results::RunEnding ending{results::Outcome::complete, "", account, bench.load_cell().health(), sequence.box_bias()};
  if (!cause) return {order.file, writer.finish(ending), account};

  ending.outcome = results::Outcome::aborted;
  ending.outcome_reason = what(cause) + explanation;
  try {
    (void)writer.finish(ending);
  } catch (const results::RecordError&) {
    // The first cause matters more; the .part file stays as it was secured last.
  }
  rethrow_with(cause, fmt::format("{}; recorded so far: {}", explanation, writer.path().string()));
}

}  // namespace kphi::daq
