#include "daq/run.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>
#include <optional>

#include "daq/interrupt.hpp"
#include "daq/recorder.hpp"
#include "daq/spin.hpp"
#include "results/run_writer.hpp"
#include "results/version.hpp"

namespace kphi::daq {
namespace {

using results::Phase;

constexpr Duration kTickWall = std::chrono::milliseconds(10);
constexpr Duration kPatienceWall = std::chrono::milliseconds(500);
constexpr double kStandstillRadPerSec = 5.0;
constexpr double kSpinDownLimitSeconds = 30.0;

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
    end_ = bench.clock().now() + from_seconds(order.remaining_bench_s);
  }

  void run() {
    wait_for_standstill();
    hold_zero(Phase::zero_before);
    recorder_.take_zero();
    spin_through_the_steps();
    wait_for_standstill();
    hold_zero(Phase::zero_after);
    recorder_.mark(Phase::end, -1, RadPerSec(0));
  }

 private:
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
    for (const std::string& failure : {bench_.motor().failure(), bench_.load_cell().failure()}) {
      if (!failure.empty()) throw SafetyStop(failure);
    }
    const Instant now = bench_.clock().now();
    seen_ = recorder_.observe(now);
    if (auto trip = check(seen_, order_.campaign.limits, bench_.clock().stretched(kPatienceWall))) {
      throw SafetyStop(trip->reason);
    }
    if (spin) spin->renew();
    position_.remaining_s = to_seconds(bench_.clock().shrunk(std::max(Duration(0), end_ - now)));
    progress_.tick(position_, seen_);
  }

  Bench& bench_;
  Recorder& recorder_;
  const RunOrder& order_;
  Progress& progress_;
  const std::function<bool()>& stop_asked_;
  Position position_;
  Observation seen_;
  Instant end_{};
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

/// What went wrong, with the name of the file that holds the rest. Keeps the type of the exception.
[[noreturn]] void rethrow_naming(const std::exception_ptr& cause, const std::filesystem::path& file) {
  const std::string where = fmt::format("; recorded so far: {}", file.string());
  try {
    std::rethrow_exception(cause);
  } catch (const Interrupted& e) {
    throw Interrupted(e.what() + where);
  } catch (const SafetyStop& e) {
    throw SafetyStop(e.what() + where);
  } catch (const results::RecordError& e) {
    throw results::RecordError(e.what() + where);
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
  Recorder recorder(bench, writer,
                    {order.place.thrust_axis, order.place.thrust_sign, streaming->scale().counts_per_newton});
  std::exception_ptr cause;
  {
    const auto draining = bench.keep_calling([&] { recorder.drain(); });
    try {
      Sequence(bench, recorder, order, progress, stop_asked).run();
    } catch (...) {
      cause = std::current_exception();
    }
  }
  streaming.reset();
  recorder.drain();
  const results::SampleAccount account = bench.load_cell().account();
  if (!cause) {
    try {
      recorder.check_failure();
    } catch (...) {
      cause = std::current_exception();
    }
  }
  if (!cause) return {order.file, writer.finish({results::Outcome::complete, "", account, {}, {}}), account};

  std::string reason = "unknown";
  try {
    std::rethrow_exception(cause);
  } catch (const std::exception& e) {
    reason = e.what();
  }
  try {
    (void)writer.finish({results::Outcome::aborted, reason, account, {}, {}});
  } catch (const results::RecordError&) {
    // The first cause matters more; the .part file stays as it was secured last.
  }
  rethrow_naming(cause, writer.path());
}

}  // namespace kphi::daq
