#include "drivers/iq/session/polling.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::iq {
namespace {

constexpr std::size_t kReadings = 4096;
constexpr Duration kWatchPeriod = std::chrono::milliseconds(250);
constexpr std::size_t kUptime = kQuantities, kFaultEver = kQuantities + 1;

const Entry* entry_of(Quantity quantity, const Identity& identity) noexcept {
  switch (quantity) {
    case Quantity::speed:
      return &entry<"brushless_drive.obs_velocity">;
    case Quantity::supply_voltage:
      return &entry<"power_monitor.volts">;
    case Quantity::supply_current:
      return &entry<"power_monitor.amps">;
    case Quantity::motor_current:
      return &entry<"brushless_drive.est_motor_amps">;
    case Quantity::coil_temperature:
      if (identity.coil_temperature_client == 83) return &entry<"coil_temperature_estimator.t_coil">;
      if (identity.coil_temperature_client == 77) return &entry<"temperature_estimator.temp">;
      return nullptr;
    case Quantity::derate:
      return &entry<"brushless_drive.derate">;
    case Quantity::drive_mode:
      return &entry<"brushless_drive.drive_mode">;
    case Quantity::drive_pwm:
      return &entry<"brushless_drive.drive_pwm">;
    case Quantity::fault_now:
      return identity.fault_ever >= 0 ? &entry<"power_safety.fault_now"> : nullptr;
  }
  return nullptr;
}

}  // namespace

Polling::Polling(const Settings& settings)
    : module_id_(settings.module_id),
      byte_time_(settings.wire_byte_time),
      cycle_{from_seconds(1 / settings.telemetry_hz)},
      slow_{from_seconds(1 / settings.slow_hz)},
      watch_{kWatchPeriod},
      readings_(kReadings),
      speed_(std::nan("")) {
  for (const Quantity quantity : settings.every_cycle) every_cycle_[static_cast<std::size_t>(quantity)] = true;
}

void Polling::begin(const Identity& identity, Instant now) {
  on_ = true;
  wanted_.fill(false);
  cycle_.next = slow_.next = watch_.next = now;
  for (std::size_t i = 0; i < kQuantities; ++i) {
    questions_[i] = {entry_of(static_cast<Quantity>(i), identity), module_id_};
  }
  questions_[kUptime] = {identity.uptime_s >= 0 ? &entry<"system_control.time"> : nullptr, identity.system_control_id};
  questions_[kFaultEver] = {identity.fault_ever >= 0 ? &entry<"power_safety.fault_ever"> : nullptr, module_id_};
}

bool Polling::Beat::strike(Instant now) noexcept {
  if (now < next) return false;
  next = next + period > now ? next + period : now + period;
  return true;
}

void Polling::advance(Exchange& exchange, Instant now) {
  if (!on_) return;
  if (cycle_.strike(now)) {
    for (std::size_t i = 0; i < kQuantities; ++i) {
      if (every_cycle_[i]) want(i, exchange.counters());
    }
  }
  if (slow_.strike(now)) want_slow(exchange.counters());
  if (watch_.strike(now)) {
    want(kUptime, exchange.counters());
    want(kFaultEver, exchange.counters());
  }
  for (std::size_t i = 0; i < kQuestions; ++i) {
    if (wanted_[i] && exchange.ask(*questions_[i].entry, questions_[i].module_id, now)) wanted_[i] = false;
  }
}

void Polling::want(std::size_t question, Counters& counters) noexcept {
  if (questions_[question].entry == nullptr) return;
  if (wanted_[question]) ++counters.skipped_polls;
  wanted_[question] = true;
}

void Polling::want_slow(Counters& counters) noexcept {
  for (std::size_t tries = 0; tries < kQuantities; ++tries) {
    turn_ = (turn_ + 1) % kQuantities;
    if (every_cycle_[turn_] || questions_[turn_].entry == nullptr) continue;
    return want(turn_, counters);
  }
}

Instant Polling::deadline() const noexcept { return on_ ? std::min({cycle_.next, slow_.next, watch_.next}) : kNever; }

void Polling::take(const QueryResult& result, Counters& counters) {
  if (result.kind != QueryResult::Kind::answer) return;
  const double value = result.value();
  if (!std::isfinite(value)) {
    ++counters.bad_values;
    return;
  }
  const auto end = questions_.begin() + kQuantities;
  const auto at = std::find_if(questions_.begin(), end, [&](const Question& q) { return q.entry == &result.entry(); });
  if (at == end) return;
  const Reading reading = reading_of(result, static_cast<Quantity>(at - questions_.begin()));
  if (readings_.full()) ++counters.dropped_readings;
  readings_.push_back(reading);
  newest_ = std::max(newest_, reading.time);
  if (reading.quantity != Quantity::speed) return;
  speed_ = reading.value;
  speed_time_ = reading.time;
}

Reading Polling::reading_of(const QueryResult& result, Quantity quantity) const noexcept {
  const std::size_t reply_bytes = result.packet.length + kFrameOverhead;
  Instant from = result.request.started + byte_time_ * static_cast<std::int64_t>(result.request.bytes);
  Instant to = result.end - byte_time_ * static_cast<std::int64_t>(reply_bytes);
  // A link without real wire time (a pseudo-terminal) can answer faster than the bytes would take.
  if (to < from) {
    from = std::min(result.request.queued, result.end);
    to = result.end;
  }
  // fix16: 65536 means no derating.
  const double value = quantity == Quantity::derate ? result.value() / 65536 : result.value();
  return {quantity, value, from + (to - from) / 2, (to - from) / 2, result.stamps};
}

std::size_t Polling::take_readings(std::span<Reading> out) {
  const std::size_t n = std::min(out.size(), readings_.size());
  std::copy_n(readings_.begin(), n, out.begin());
  readings_.erase_begin(n);
  return n;
}

}  // namespace kphi::iq
