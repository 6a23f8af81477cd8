#include "daq/guard/interlock.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace kphi::daq {
namespace {

std::string words(const GuardLimit& limit, double value) {
  if (is_load_cell_axis(limit.watched)) {
    const double range = limit.value / kRangeBorne;
    return fmt::format("load cell: {} carries {:.0f} % of its range of {:g} {}", limit.name, 100 * value / range, range,
                       limit.unit);
  }
  if (limit.watched == Watched::pause)
    return fmt::format("kphi was blocked for {:.2g} s while the motor was turning", value);
  if (limit.watched == Watched::recorder_pause)
    return fmt::format("kphi could not write to the run file for {:.2g} s while the motor was turning", value);
  // As many digits as the limit has, and as many more as tell them apart.
  const std::string bound = fmt::format("{:.4g}", limit.value);
  std::string shown = limit.unit == "RPM" ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
  for (int digits = 5; shown == bound && digits <= 17; ++digits) shown = fmt::format("{:.{}g}", value, digits);
  return fmt::format("{} {} {} is {} ({})", limit.name, shown, limit.unit, to_words(limit), limit.source);
}

constexpr double kSetting = 0.011;  // V and A: the coarsest step of a supply, and rounding

std::optional<Trip> moved(const char* what, double now, double wanted, const char* unit) {
  if (std::abs(now - wanted) <= kSetting) return std::nullopt;
  return Trip{
      fmt::format("supply: {} is {:g} {}, kphi set {:g} {}: changed on the front panel", what, now, unit, wanted, unit),
      Source::supply};
}

}  // namespace

Trip passed(const GuardLimit& limit, double value) {
  const bool has_row = limit.watched < Watched::samples_missing;
  return {words(limit, value), has_row ? row_of(limit.watched).source : Source::load_cell, limit.watched};
}

std::string next_move(const Trip& trip) {
  if (trip.source == Source::computer && trip.watched != Watched::sleep) return kCheckComputer;
  if (trip.watched < Watched::samples_missing) return row_of(trip.watched).next_move;
  if (trip.watched == Watched::samples_missing) return kCheckBox;
  if (trip.watched == Watched::frozen)
    return "switch the load cell off and on, check its cable; `kphi devices` shows its noise";
  if (trip.watched == Watched::no_thrust) return "see what `kphi spin` says at a low speed";
  if (trip.watched == Watched::sleep)
    return "disable sleep, keep the lid open, then look at the stand before you continue";
  return kCheckStand;
}

SafetyStop::SafetyStop(const Trip& trip)
    : SafetyStop(StopWords{.cause = trip.reason,
                           .next_move = daq::next_move(trip),
                           .motor_failure = trip.link_failed && trip.source == Source::motor
                                                ? MotorFailure::event_to_come
                                                : MotorFailure::none}) {
  is_trip_ = true;
}

bool Latch::set(Trip trip) noexcept {
  State expected = State::open;
  if (!state_.compare_exchange_strong(expected, State::closing)) return false;
  trip_ = std::move(trip);
  state_.store(State::closed);
  return true;
}

void Latch::check() const {
  if (const Trip* trip = this->trip()) throw SafetyStop(*trip);
}

Trip slept(const Clock& clock) {
  return {fmt::format("this computer slept for {:.2g} s", to_seconds(clock.suspended())), Source::computer,
          Watched::sleep};
}

void require_awake(const Clock& clock) {
  if (has_slept(clock)) throw SafetyStop(slept(clock));
}

std::string tripped_words(const SupplyReading& seen) {
  return fmt::format("supply: {} protection switched the output off", name_of(seen.protection));
}

std::optional<Trip> check(const SupplyReading& seen, const profiles::SupplyConfig& wanted, bool settled) {
  const double volts = wanted.voltage.value();
  const auto trouble = [](const std::string& what) { return Trip{"supply: " + what, Source::supply}; };
  const bool limits = seen.regulation == SupplyRegulation::constant_current;
  if (seen.protection != SupplyProtection::none)
    return Trip{tripped_words(seen), Source::supply, Watched::state, false, seen.protection};
  if (seen.output == 0) return trouble("output is off");
  if (limits && settled)
    return trouble(fmt::format("current limit reached: {:.3g} A at {:.4g} V", seen.current_a, seen.voltage_v));
  if (auto trip = moved("set voltage", seen.set_voltage_v, volts, "V")) return trip;
  if (auto trip = moved("current limit", seen.current_limit_a, wanted.current_limit.value(), "A")) return trip;
  if (!settled) return std::nullopt;
  // Written so that NaN trips.
  if (!(seen.voltage_v >= (1 - results::kSupplySag) * volts))
    return trouble(fmt::format("{:.4g} V at the terminals, more than {:g} % below the {:g} V set", seen.voltage_v,
                               100 * results::kSupplySag, volts));
  if (seen.voltage_v > (1 + results::kSupplyRise) * volts)
    return trouble(fmt::format("{:.4g} V at the terminals, more than {:g} % above the {:g} V set: the motor feeds back",
                               seen.voltage_v, 100 * results::kSupplyRise, volts));
  return std::nullopt;
}

void rethrow_without_power(SupplyLink* supply) {
  const auto cause = std::current_exception();
  StopWords words = words_of(cause);
  if (supply != nullptr && words.state.empty()) words.leaves(supply->switch_off());
  const RunStopped* stopped = as<RunStopped>(cause);
  // As it was thrown, whatever its type, where there is nothing to add.
  if (words.state.empty() || (stopped != nullptr && words.state == stopped->words().state))
    std::rethrow_exception(cause);
  if (as<SafetyStop>(cause) != nullptr) throw SafetyStop(words);
  if (as<Interrupted>(cause) != nullptr) throw Interrupted(words);
  const Error* error = as<Error>(cause);
  throw RunStopped(words, error != nullptr ? error->exit_code() : ExitCode::failure);
}

void leave_without_power(Bench& bench, const std::function<void()>& work) {
  try {
    work();
  } catch (...) {
    rethrow_without_power(bench.supply());
  }
  (void)bench.switch_off_power();
}

MotorPower::MotorPower(SupplyLink* supply, const StopAsked& stop_asked) : supply_(supply) {
  if (supply_ != nullptr) switch_on(stop_asked);
}

void MotorPower::switch_on(const StopAsked& stop_asked) {
  try {
    on_ = std::make_unique<OutputEnable>(*supply_, stop_asked);
  } catch (...) {
    rethrow_without_power(supply_);
  }
}

bool MotorPower::off(MotorLink& motor) {
  if (supply_ == nullptr) return false;
  motor.rest();
  if (const std::string why = supply_->switch_off(); !why.empty())
    throw SafetyStop(why, "cut the power of the motor at the switch before you go near");
  on_.reset();
  return true;
}

void MotorPower::restore(MotorLink& motor, const Clock& clock, const StopAsked& stop_asked,
                         const std::function<void()>& wait_for_voltage) {
  require_awake(clock);
  require_no_stop(stop_asked, "before the motor had power");
  if (supply_ != nullptr) {
    switch_on(stop_asked);
    wait_for_voltage();
  }
  if (supply_ != nullptr || !motor.failure().empty()) motor.wake(stop_asked);
  require_no_stop(stop_asked, "before the motor turned");
}

}  // namespace kphi::daq
