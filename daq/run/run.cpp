#include "daq/run/run.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/uuid_io.hpp>

#include "base/error.hpp"
#include "daq/audit/bench_audit.hpp"
#include "daq/bench/box.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/run/recorder.hpp"
#include "daq/run/sequence.hpp"
#include "results/reduction/reduction.hpp"
#include "results/run_writer.hpp"
#include "results/version.hpp"

namespace kphi::daq {
namespace {

constexpr int kReadings = 2;  // attempts at the end; a page may be lost

results::RunHeader header_of(const RunOrder& order, Bench& bench, const results::LoadCellScale& scale) {
  const profiles::Campaign& campaign = order.campaign;
  const profiles::BenchConfig& config = order.config;
  results::RunHeader header;
  header.origin = name_of(config.origin());
  header.started_utc = utc_text(bench.clock(), bench.clock().now());
  // A name-based UUID: unique by campaign, config in it and time, and reproducible on the deterministic bench.
  const std::string name = fmt::format("{}\n{}\n{}\n{}", campaign.text, order.file.filename().string(),
                                       header.started_utc, bench.clock().now().count());
  header.uuid = boost::uuids::to_string(boost::uuids::name_generator_sha1(boost::uuids::ns::oid())(name));
  header.tool_version = kVersion;
  header.campaign_name = campaign.name;
  header.campaign_text = campaign.text;
  header.bench_text = config.text;
  header.operator_name = campaign.operator_name;
  header.propeller_id = campaign.propeller.id;
  header.propeller_name = campaign.propeller.name;
  header.diameter_in = campaign.propeller.diameter_in;
  header.blades = campaign.propeller.blades;
  header.occlusion_deg = order.mounted.occlusion_deg();
  header.repetition = order.planned.repetition;
  header.thrust_axis = config.thrust_axis;
  header.thrust_sign = config.thrust_sign;
  header.spin = config.iq.spin;
  header.minimum_discard_s = campaign.minimum_discard.value();
  header.supply_voltage_v = campaign.supply.value();
  header.coil_temperature_max_degc = limit_of_files(Watched::coil_temperature, campaign, config);
  if (const auto& gain = config.iq.clock_gain) {
    header.clock_gain = gain->factor;
    header.clock_gain_u = gain->u_factor;
  }
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

/// The load cell streams while it lives.
using Streaming = std::unique_ptr<LoadCellLink, decltype([](LoadCellLink* cell) { cell->stop(); })>;

/// Checks a box whose settings changed since they were last read against the campaign. Throws ConfigurationError.
void judge_changes(const std::optional<netbox::Configuration>& before, const LoadCellLink& cell, const RunOrder& order,
                   Progress& progress) {
  if (!before) return;
  const netbox::Changes changes = changes_since(*before, *cell.box(), order.campaign.box_bias);
  if (changes == 0) return;
  progress.say("load cell: configuration changed since it was last read: " + netbox::to_words(changes) +
               "; recording this run with the present scale");
  require_suitable(cell, order.campaign, order.config);
}

bool is_interrupted(const std::exception_ptr& cause) { return as<Interrupted>(cause) != nullptr; }

bool is_trip(const std::exception_ptr& cause) {
  const auto* stop = as<SafetyStop>(cause);
  return stop != nullptr && stop->is_trip();
}

/// The same exception with more words; a DeviceError becomes a SafetyStop.
[[noreturn]] void rethrow_with(const std::exception_ptr& cause, const StopWords& words) {
  try {
    std::rethrow_exception(cause);
  } catch (const Interrupted&) {
    throw Interrupted(words);
  } catch (const SafetyStop&) {
    throw SafetyStop(words);
  } catch (const RecordError&) {
    throw RecordError(words.line() + "; recorded so far: " + words.data);
  } catch (const DeviceError&) {
    throw SafetyStop(words);  // the device was there: its failure in the middle of a run is a safety stop
  }
}

results::MotorCounts operator-(results::MotorCounts now, const results::MotorCounts& before) {
  for (std::size_t i = 0; i < now.size(); ++i) now[i] -= std::min(now[i], before[i]);
  return now;
}

/// How the sequence of a run ended.
struct Ended {
  std::exception_ptr cause;  ///< null: it is complete
  StopWords words;
};

/// A trip of the guard is the cause of any error that the runner met after it.
void find_cause(Guard& guard, Ended& ended) {
  guard.notice_sleep();
  ended.words = words_of(ended.cause);
  const Trip* trip = guard.latch().trip();
  if (trip == nullptr || is_trip(ended.cause)) return;
  const SafetyStop stop(*trip);
  const StopWords met = std::exchange(ended.words, stop.words());
  if (met.motor_failure != MotorFailure::none && ended.words.motor_failure != MotorFailure::none)
    ended.words.motor_failure = met.motor_failure;  // the same failure, seen twice
  else if (!is_interrupted(ended.cause))
    ended.words.also(met.cause);
  ended.cause = std::make_exception_ptr(stop);
}

/// When this returns, the motor coasts, and unless the run is complete the supply is off.
Ended carry_out(Sequence& sequence, Bench& bench, Guard& guard, Recorder& recorder) {
  Ended ended;
  const auto guarding = bench.run_periodically({"guard", true}, [&] { guard.poll(); });
  const auto draining = bench.run_periodically({"recorder"}, [&] { recorder.drain(); });
  try {
    // No longer than that: what computes for long, as finishing a file does, must not have it.
    std::string told_before;
    const auto prompt = bench.keep_prompt(told_before);
    sequence.run();
  } catch (...) {
    ended.cause = std::current_exception();  // the motor coasts since the MotorEnable has gone
    find_cause(guard, ended);
    guard.stand_down();
    if (bench.supply() != nullptr) bench.supply()->cut();
    ended.words.also(sequence.explanation());
    sequence.add_aftermath(ended.words);
  }
  return ended;
}

/// Call it once the stream has stopped.
void record_the_rest(Sequence& sequence, Guard& guard, Recorder& recorder, Ended& ended) {
  guard.stand_down();
  for (bool more = true; more; recorder.drain()) more = guard.relay();
  try {
    if (const auto event = guard.event()) recorder.note(*event);
    if (const auto& event = sequence.supply_event()) recorder.note(*event);
  } catch (const RecordError&) {
    // The first cause matters more.
  }
  if (!ended.cause) {
    try {
      guard.latch().check();
      recorder.check_failure();
      sequence.compare_configuration(kReadings);
    } catch (...) {
      ended.cause = std::current_exception();
      ended.words = words_of(ended.cause);
      sequence.add_aftermath(ended.words);
    }
  }
  if (ended.cause && ended.words.consequences.empty() && !is_interrupted(ended.cause)) {
    try {
      sequence.compare_configuration(1);  // changed units can look like an exceeded limit
    } catch (const RecordError&) {
    }
  }
}

}  // namespace

std::string utc_text(const Clock& clock, Instant when) {
  const auto seconds = std::chrono::time_point_cast<std::chrono::seconds>(
      clock.epoch_utc() + std::chrono::duration_cast<std::chrono::system_clock::duration>(clock.shrunk(when)));
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(seconds)));
}

RunResult record_run(Bench& bench, const RunOrder& order, Progress& progress, const std::function<bool()>& stop_asked) {
  std::optional<netbox::Configuration> before;
  if (const auto* box = bench.load_cell().box()) before = *box;
  const results::MotorCounts counts_before = bench.motor().counts();
  const results::LoadCellScale scale = bench.load_cell().start();
  Streaming streaming(&bench.load_cell());
  judge_changes(before, bench.load_cell(), order, progress);
  results::RunWriter writer(order.file, header_of(order, bench, scale), bench.files());
  const DeviceLimits devices = device_limits(bench);
  const std::vector<GuardLimit> limits = combine_limits(order.campaign, order.config, &devices);
  progress.guarded(limits);
  Guard guard(bench, order.config, scale, limits, order.campaign.propeller.blades);
  Recorder recorder(bench, guard, writer);
  Sequence sequence(bench, recorder, guard, order, progress, stop_asked);
  Ended ended = carry_out(sequence, bench, guard, recorder);
  streaming.reset();
  record_the_rest(sequence, guard, recorder, ended);
  const SampleAccount account = bench.load_cell().account();
  results::RunEnding ending{
      results::Outcome::complete, "", account, bench.load_cell().health(), bench.motor().counts() - counts_before,
      sequence.box_bias()};
  if (!ended.cause)
    return {order.file, writer.finish(ending, results::views_of), account, sequence.stop(),
            sequence.steps_not_needed()};

  ending.outcome = results::Outcome::aborted;
  ending.outcome_reason = ended.words.line();
  try {
    (void)writer.finish(ending, results::views_of);
  } catch (const RecordError&) {
    // The first cause matters more; the .part file stays as it was last synced.
  }
  ended.words.data = writer.path().string();
  rethrow_with(ended.cause, ended.words);
}

}  // namespace kphi::daq
