#include "daq/run/sequence.hpp"

#include <fmt/format.h>

#include <utility>

#include "base/error.hpp"
#include "daq/bench/box.hpp"
#include "daq/bench/device_records.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/rest_guard.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/run/speed_cap.hpp"
#include "daq/run/step_watch.hpp"
#include "profiles/thrust_prior.hpp"
#include "results/reduction/quality_flags.hpp"

namespace kphi::daq {
namespace {

using results::Phase;

constexpr Duration kTickWall = std::chrono::milliseconds(10);
constexpr double kHandSlew = 200;  // rad/s², where the campaign sets none
constexpr double kEndRamp = 1000;  // rad/s², on a supply that sinks what it feeds back
constexpr Duration kBiasWorksWall = std::chrono::milliseconds(100);    // samples in transit still carry the old zero
constexpr Duration kExplanationWall = std::chrono::seconds(3);         // the box is asked over HTTP for 2 s
constexpr Duration kAftermath = std::chrono::seconds(6);               // a rotor of a few inches is at rest after three
constexpr Duration kLastReadingWall = std::chrono::milliseconds(500);  // of a supply whose output is off
constexpr int kBiasAttempts = 3;
constexpr int kEventsShown = 10;

constexpr double kThrustFloor_n = 0.1, kThrustFloorOfNoise = 5;
constexpr double kMostOccluded_deg = 180;  // beyond it too little thrust may be left to expect any

ThrustExpectation expected_thrust(const RunOrder& order, double noise_n) {
  const auto prior = profiles::thrust_prior(order.campaign.propeller);
  const bool expects = prior && order.mounted.occlusion_deg() <= kMostOccluded_deg;
  return {std::max(kThrustFloor_n, kThrustFloorOfNoise * noise_n), expects ? prior->low.value() / 2 : 0};
}

/// An answer to the question why the box is silent, or the end of its silence.
bool explains_silence(EventKind kind) {
  return kind == EventKind::taken_over || kind == EventKind::rdt_disabled || kind == EventKind::unreachable ||
         kind == EventKind::unusable || kind == EventKind::resumed;
}

}  // namespace

Sequence::Sequence(Bench& bench, Recorder& recorder, Guard& guard, const RunOrder& order, Progress& progress,
                   const std::function<bool()>& stop_asked)
    : bench_(bench), recorder_(recorder), guard_(guard), order_(order), progress_(progress), stop_asked_(stop_asked) {
  position_.name(order.campaign.propeller.id);
  position_.occlusion_deg = order.mounted.occlusion_deg();
  position_.run = order.run;
  position_.runs = order.runs;
  position_.samples_before = order.samples_before;
  position_.repetition = order.planned.repetition;
  position_.repetitions = std::max(order.campaign.repetitions, order.planned.repetition);
  position_.steps = static_cast<int>(order.planned.steps.size());
  begin_ = bench.clock().now();
  end_ = begin_ + from_seconds(order.run_bench_s);
}

void Sequence::run() {
  wait_for_standstill();
  if (order_.campaign.box_bias) take_box_bias();
  hold_zero(Phase::zero_before);
  require_rest();
  const netbox::ZeroMeasurement zero = recorder_.measured();
  const auto axis = static_cast<std::size_t>(order_.config.thrust_axis);
  guard_.take_zero(zero.mean);
  zero_n_ = zero.mean[axis];
  if (order_.steering == nullptr) guard_.expect_thrust(expected_thrust(order_, zero.standard_deviation[axis]));
  spin();
  wait_for_standstill();
  hold_zero(Phase::zero_after);
  mark(Phase::end);
}

void Sequence::add_aftermath(StopWords& words) {
  if (bench_.supply() != nullptr) switch_off(words);
  // Without power nothing drives the motor, and the module cannot answer.
  if (bench_.supply() == nullptr || !power_is_off_) watch_the_coast(words);
}

void Sequence::watch_the_coast(StopWords& words) {
  const auto add = [&](const std::string& what) { words.leaves("motor: " + what); };
  const auto add_stop = [&](const iq::StopReport& stop) {
    words.at_rest = stop.outcome == iq::StopReport::Outcome::standing;
    add(stop.summary());
  };
  words.at_rest = !has_spun_;
  if (!has_spun_) return add("was not turning");
  if (stop_) return add_stop(*stop_);
  iq::StopSettings settings;
  settings.limit = kAftermath;
  bench_.motor().begin_stop(settings);
  const Instant give_up = bench_.clock().now() + 4 * kAftermath;
  while (!stop_ && bench_.clock().now() < give_up) {
    for (const StreamEvent& event : recorder_.take_events()) {
      if (!ends_a_run(event.kind)) continue;
      if (words.motor_failure != MotorFailure::event_to_come) words.also(event.text);
      words.motor_failure = MotorFailure::reported;
    }
    stop_ = bench_.motor().stop_report();
    if (!stop_) bench_.wait_until(bench_.clock().now() + bench_.clock().stretched(kTickWall));
    show_coast();
  }
  add_stop(stop_ ? *stop_ : iq::StopReport{});
}

/// What is left of the speed, for whoever pressed STOP.
void Sequence::show_coast() {
  position_.phase = kPhaseWords[static_cast<std::size_t>(Phase::spin_down)];
  position_.step = -1;
  position_.commanded = RadPerSec(0);
  progress_.tick(position_, guard_.observe(bench_.clock().now()));
}

void Sequence::switch_off(StopWords& words) {
  const Instant since = bench_.clock().now();
  const Observation last = guard_.observe(since);
  const bool rests = position_.commanded.value() == 0 && last.motor_is_fresh() && last.speed() <= kStandstill;
  const std::string why = bench_.supply()->switch_off();
  power_is_off_ = why.empty();
  if (!power_is_off_) {
    const Trip* trip = guard_.latch().trip();
    const bool is_cause = trip != nullptr && trip->source == Source::supply;
    if (!is_cause) words.also(bench_.supply()->failure());
    return words.leaves(why);
  }
  const Instant give_up = bench_.clock().now() + bench_.clock().stretched(kLastReadingWall);
  const auto newest = [this] { return guard_.observe(bench_.clock().now()).supply; };
  while (newest().time_ns < since.count() && bench_.clock().now() < give_up)
    bench_.wait_until(bench_.clock().now() + bench_.clock().stretched(kTickWall));
  words.at_rest = rests || !has_spun_;
  words.state = fmt::format("motor: {}; supply: output off", !has_spun_ ? "was not turning"
                                                             : rests    ? "at rest, now without power"
                                                                        : "ordered to coast, now without power");
  const SupplyReading seen = newest();
  if (seen.protection == SupplyProtection::none) return;
  const Trip* trip = guard_.latch().trip();
  if (trip != nullptr && trip->protection == seen.protection) return;
  const std::string tripped = tripped_words(seen);
  supply_event_ = event_at(bench_.clock().now(), EventKind::supply_stop, tripped);
  words.also(tripped);
}

void Sequence::compare_configuration(int attempts) {
  const netbox::Configuration* box = bench_.load_cell().box();
  if (box == nullptr) return;
  const auto event = configuration_event(
      *box, box_bias_.records > 0, [&] { return bench_.load_cell().page(); }, [&] { return bench_.clock().now(); },
      attempts);
  if (!event) return;
  recorder_.note(*event);
  progress_.say("load cell: " + event->text);
}

std::string Sequence::explanation() {
  const Instant since = bench_.clock().now();
  const auto stretched = [&](Duration wall) { return bench_.clock().stretched(wall); };
  if (guard_.observe(since).load_cell_age < stretched(spin_patience(order_.config)) / 2) return {};
  if (!stalled_.empty()) return stalled_;
  while (bench_.clock().now() < since + stretched(kExplanationWall) && !stop_asked_()) {
    for (const StreamEvent& event : recorder_.take_events()) {
      if (explains_silence(event.kind)) return event.text;
    }
    bench_.wait_until(bench_.clock().now() + stretched(kTickWall));
  }
  return {};
}

void Sequence::take_box_bias() {
  const netbox::ZeroMeasurement before = hold_zero(Phase::bias_before);
  if (const auto why = unrest(before)) throw DeviceError("Net Box", "take the bias", *why, results::kZeroNextMove);
  // The box takes one noisy sample as its zero: after a bad one, try again.
  for (int attempt = 1;; ++attempt) {
    set_box_bias();
    const netbox::ZeroMeasurement after = hold_zero(Phase::bias_after);
    box_bias_ = to_bias(before, after);
    const auto remains = beyond_zero(after);
    if (!remains) return;
    if (attempt == kBiasAttempts) throw DeviceError("Net Box", "take the bias", *remains, results::kZeroNextMove);
  }
}

void Sequence::set_box_bias() {
  mark(Phase::bias_settling);
  bench_.load_cell().set_bias();
  LoadCellLink& cell = bench_.load_cell();
  hold(bench_.clock().stretched(kBiasWorksWall) +
       from_seconds(3 * cell.records_together() / cell.scale().sample_rate_hz));
}

void Sequence::ramp_to(RadPerSec level, MotorEnable& spin) {
  const Slew slew(position_.commanded, level, order_.campaign.profile.slew_rad_s2);
  if (slew.lasts() == Duration(0)) return;
  mark(Phase::ramp, -1, level);
  const Duration tick = bench_.clock().stretched(kTickWall);
  Instant last = bench_.clock().now();
  for (Duration into(0); into < slew.lasts();) {
    position_.commanded = slew.at(into);
    change_speed();
    spin.at(position_.commanded);
    hold(std::min(tick, slew.lasts() - into), &spin);
    // A late tick delays the ramp: a jump to where it should be by now would feed current back into the supply.
    const Instant now = bench_.clock().now();
    into += std::min(now - std::exchange(last, now), 2 * tick);
  }
}

void Sequence::go_through_the_steps(MotorEnable& spin) {
  const auto& until = order_.campaign.profile.until;
  std::optional<profiles::RunCertainty> certainty;
  if (until) certainty.emplace(*until, order_.planned.steps);
  for (auto step = order_.planned.steps.begin(); step != order_.planned.steps.end(); ++step) {
    const bool reached = !out_of_reach_ || step->speed < *out_of_reach_;
    if (reached && (!certainty || certainty->needs(*step))) {
      hold_step(*step, certainty, spin);
      learn_from(*step, std::span(step + 1, order_.planned.steps.end()));
      continue;
    }
    if (certainty) certainty->left_out(*step);
    if (reached) leave_out(1);
    steps_not_needed_ += reached;
  }
}

void Sequence::leave_out(std::ptrdiff_t steps) {
  position_.steps -= static_cast<int>(steps);
  ends_sooner(static_cast<double>(steps) * order_.campaign.profile.dwell.value());
}

void Sequence::ends_sooner(double seconds) {
  if (order_.all_steps) end_ -= from_seconds(seconds);
}

void Sequence::follow(Steering& steering, MotorEnable& spin) {
  const double slew = order_.campaign.profile.slew_rad_s2.value_or(kHandSlew);
  const Duration tick = bench_.clock().stretched(kTickWall);
  std::optional<RadPerSec> target;
  bool holds = false;
  Instant last = bench_.clock().now();
  const auto leave = [&] {
    if (std::exchange(holds, false)) progress_.step_done(position_, seen_);
  };
  while (const auto wanted = steering.wanted(bench_.clock().now(), position_.commanded)) {
    const Instant now = bench_.clock().now();
    const double most = slew * to_seconds(std::min(now - std::exchange(last, now), 2 * tick));
    if (position_.commanded != *wanted) {
      leave();
      if (std::exchange(target, *wanted) != wanted) mark(Phase::ramp, -1, *wanted);
      const double left = (*wanted - position_.commanded).value();
      position_.commanded =
          std::abs(left) <= most ? *wanted : position_.commanded + RadPerSec(std::clamp(left, -most, most));
      change_speed();
      spin.at(position_.commanded);
    } else if (!std::exchange(holds, true)) {
      target.reset();
      position_.steps = ++position_.step + 1;
      mark(Phase::step, position_.step, position_.commanded);
    }
    hold(tick, &spin);
  }
  leave();
  progress_.say("stopping: " + steering.why());
}

void Sequence::spin() {
  MotorEnable spin(bench_.motor(), order_.config.iq.spin, guard_);
  has_spun_ = true;
  order_.steering != nullptr ? follow(*order_.steering, spin) : go_through_the_steps(spin);
  position_.step = -1;
  position_.commanded = RadPerSec(0);
  mark(Phase::spin_down);
  change_speed();
  iq::StopSettings stop;
  if (order_.config.supply_sinks_current) stop.deceleration = kEndRamp;
  spin.begin_stop(stop);
  while (!(stop_ = spin.stopped())) hold(bench_.clock().stretched(kTickWall), &spin);
  if (!stop_->safe()) throw SafetyStop("motor: " + stop_->summary());
}

void Sequence::hold_step(const profiles::PlannedStep& step, std::optional<profiles::RunCertainty>& certainty,
                         MotorEnable& spin) {
  ramp_to(step.speed, spin);
  ++position_.step;
  position_.commanded = step.speed;
  change_speed();
  spin.at(step.speed);
  mark(Phase::step, step.number, step.speed);
  if (certainty)
    hold_until_certain(step, *certainty, spin);
  else
    hold(from_seconds(order_.campaign.profile.dwell.value()), &spin);
  progress_.step_done(position_, seen_);
}

void Sequence::hold_until_certain(const profiles::PlannedStep& step, profiles::RunCertainty& certainty,
                                  MotorEnable& spin) {
  const auto& profile = order_.campaign.profile;
  const double most_s = profile.dwell.value();
  const auto axis = static_cast<std::size_t>(order_.config.thrust_axis);
  StepWatch watch(order_.campaign.minimum_discard.value(), most_s);
  const Instant begin = bench_.clock().now();
  const auto since = [&] { return to_seconds(bench_.clock().now() - begin); };
  const Duration tick_length = bench_.clock().stretched(kTickWall);
  while (since() < most_s) {
    hold(std::min(tick_length, from_seconds(most_s - since())), &spin);
    const netbox::ZeroMeasurement measured = recorder_.measured();
    watch.add(since(), measured.records, measured.mean[axis]);
    if (since() < profile.until->dwell_least.value()) continue;
    const auto [mean_n, u_n] = watch.known();
    if (u_n <= certainty.enough_n(step, mean_n - zero_n_)) break;  // false while one of them is unknown
  }
  const auto [mean_n, u_n] = watch.known();
  certainty.held(step, mean_n - zero_n_, u_n, since());
  ends_sooner(std::max(0.0, most_s - since()));
}

void Sequence::learn_from(const profiles::PlannedStep& step, std::span<const profiles::PlannedStep> later) {
  if (!seen_.motor_is_fresh() || !is_out_of_drive(step.speed, seen_.speed(), seen_.drive_pwm)) return;
  const double volts = seen_.judged[Watched::supply_voltage_low], wanted = order_.campaign.supply.value();
  if (volts < (1 - results::kSupplyBand) * wanted)
    return progress_.say(
        fmt::format("supply: {:.3g} V at the motor instead of {:g} V, so full drive gives {:.0f} of {:.0f} "
                    "RPM; check its leads and its current limit",
                    volts, wanted, to_rpm(seen_.speed()), to_rpm(step.speed)));
  out_of_reach_ = step.speed;
  const auto out = std::ranges::count_if(later, [&](const auto& one) { return one.speed >= *out_of_reach_; });
  if (out == 0) return;
  leave_out(out);
  progress_.say(fmt::format("motor: full drive gives {:.0f} of {:.0f} RPM; skipping {} steps at or above",
                            to_rpm(seen_.speed()), to_rpm(step.speed), out));
}

void Sequence::mark(Phase phase, int step, RadPerSec commanded) {
  position_.phase = kPhaseWords[static_cast<std::size_t>(phase)];
  const results::PhaseMark mark{phase, step, bench_.clock().now().count(), commanded.value()};
  recorder_.mark(mark);
  guard_.mark(mark);
}

void Sequence::change_speed() {
  guard_.settles_until(bench_.clock().now() + from_seconds(order_.campaign.minimum_discard.value()));
}

netbox::ZeroMeasurement Sequence::hold_zero(Phase phase) {
  mark(phase);
  hold(from_seconds(order_.campaign.zero.value()));
  if (phase == Phase::zero_after) {  // the end of the run, whenever it was expected
    end_ = bench_.clock().now();
    show_progress();
  }
  progress_.step_done(position_, seen_);
  return recorder_.measured();
}

void Sequence::require_rest() {
  while (!seen_.load_cell_is_fresh()) hold(bench_.clock().stretched(kTickWall));  // check() ends this
  const auto axis = static_cast<std::size_t>(order_.config.thrust_axis);
  const netbox::ZeroMeasurement zero = recorder_.measured();
  if (zero.records < 2)
    throw DeviceError("Net Box", "take the zero", "no valid sample arrived", "check the box's status: `kphi devices`");
  if (!(zero.standard_deviation[axis] > 0))
    throw DeviceError(
        "load cell", "take the zero",
        fmt::format("{} repeated one value in all {} samples: it is frozen", kAxisNames[axis], zero.records),
        "switch it off and on, check its cable; `kphi devices` shows its noise");
  if (const auto why = noise(zero, axis, results::kNoisyZero))
    throw DeviceError("Net Box", "take the zero", *why, results::kZeroNextMove);
}

void Sequence::wait_for_standstill() {
  position_.phase = kPhaseWords[static_cast<std::size_t>(Phase::spin_down)];
  const Instant give_up = bench_.clock().now() + from_seconds(kSpinDownLimitSeconds);
  // Wait for a speed reading taken after the coast.
  hold(bench_.clock().stretched(20 * kTickWall));
  // Written so that NaN is not at rest.
  for (RadPerSec speed; !((speed = guard_.observe(bench_.clock().now()).speed()) <= kStandstill);) {
    if (bench_.clock().now() > give_up) throw still_turning(speed);
    hold(bench_.clock().stretched(kTickWall));
  }
}

void Sequence::hold(Duration duration, MotorEnable* spin) {
  const Instant until = bench_.clock().now() + duration;
  for (Instant now = bench_.clock().now(); now < until; now = bench_.clock().now()) {
    bench_.wait_until(std::min(until, now + bench_.clock().stretched(kTickWall)));
    tick(spin);
  }
}

void Sequence::tick(MotorEnable* spin) {
  if (stop_asked_()) throw Interrupted("stopped by request");
  recorder_.check_failure();
  spin ? spin->renew() : guard_.check(false);
  show_events();
  seen_ = guard_.observe(bench_.clock().now());
  show_progress();
}

void Sequence::show_progress() {
  const Instant now = bench_.clock().now();
  const Duration left = std::max(Duration(0), end_ - now), passed = std::max(Duration(1), now - begin_);
  const double share = to_seconds(passed) / to_seconds(passed + left);
  position_.done = std::max(position_.done, (std::max(position_.run, 1) - 1 + share) / std::max(position_.runs, 1));
  position_.remaining_s = to_seconds(bench_.clock().shrunk(left + from_seconds(order_.later_bench_s)));
  progress_.tick(position_, seen_);
}

void Sequence::show_events() {
  for (const StreamEvent& event : recorder_.take_events()) {
    if (event.kind == EventKind::stalled) stalled_ = event.text;
    if (event.kind == EventKind::stall_ended) stalled_.clear();
    const bool says_so = event.kind == EventKind::sentinel_replaced;  // whose it is
    const std::string line = (says_so ? "" : is_of_motor(event.kind) ? "motor: " : "load cell: ") + event.text;
    if (events_shown_ < kEventsShown) progress_.say(line);
    if (++events_shown_ == kEventsShown) progress_.say("further events of this run go to its file only: `kphi info`");
    if (ends_a_run(event.kind)) throw SafetyStop(StopWords{.cause = line, .motor_failure = MotorFailure::reported});
  }
}

}  // namespace kphi::daq
