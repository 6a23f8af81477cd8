#include "drivers/iq/session/polling.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::iq {
namespace {

constexpr std::size_t kReadings = 4096;
constexpr Duration kWatchPeriod = std::chrono::milliseconds(250);
constexpr std::size_t kUptime = kMotorChannels.size(), kFaultEver = kUptime + 1;

/// In the order of MotorChannel; null: depends on the module.
constexpr std::array<const Entry*, kMotorChannels.size()> kEntryOf{&entry<"brushless_drive.obs_velocity">,
                                                                   &entry<"power_monitor.volts">,
                                                                   &entry<"power_monitor.amps">,
                                                                   &entry<"brushless_drive.est_motor_amps">,
                                                                   nullptr,
                                                                   &entry<"brushless_drive.derate">,
                                                                   &entry<"brushless_drive.drive_mode">,
                                                                   &entry<"brushless_drive.drive_pwm">,
                                                                   nullptr};

const Entry* coil_temperature_of(const AuditRecord& identity) {
  if (identity.value<"coil_temperature_estimator.t_coil">()) return &entry<"coil_temperature_estimator.t_coil">;
  return identity.value<"temperature_estimator.temp">() ? &entry<"temperature_estimator.temp"> : nullptr;
}

}  // namespace

Polling::Polling(const Settings& settings)
    : module_id_(settings.module_id),
      cycle_{from_seconds(1 / settings.telemetry_hz)},
      slow_{from_seconds(1 / settings.slow_hz)},
      watch_{kWatchPeriod},
      readings_(kReadings),
      speed_(std::nan("")) {
  for (const MotorChannel channel : settings.every_cycle) every_cycle_[static_cast<std::size_t>(channel)] = true;
}

void Polling::begin(const AuditRecord& identity, int system_control_id, Instant now) {
  on_ = true;
  wanted_.fill(false);
  cycle_.next = slow_.next = watch_.next = now;
  for (std::size_t i = 0; i < kChannels; ++i) questions_[i] = {kEntryOf[i], module_id_};
  questions_[static_cast<std::size_t>(MotorChannel::coil_temperature)].entry = coil_temperature_of(identity);
  const bool tells_time = identity.value<"system_control.time">().has_value();
  questions_[kUptime] = {tells_time ? &entry<"system_control.time"> : nullptr, system_control_id};
  const bool tells_faults = identity.value<"power_safety.fault_ever">().has_value();
  questions_[static_cast<std::size_t>(MotorChannel::fault_now)].entry =
      tells_faults ? &entry<"power_safety.fault_now"> : nullptr;
  questions_[kFaultEver] = {tells_faults ? &entry<"power_safety.fault_ever"> : nullptr, module_id_};
}

bool Polling::Beat::strike(Instant now) noexcept {
  if (now < next) return false;
  next = next + period > now ? next + period : now + period;
  return true;
}

void Polling::advance(Exchange& exchange, Instant now) {
  if (!on_) return;
  if (cycle_.strike(now)) {
    for (std::size_t i = 0; i < kChannels; ++i) {
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
  for (std::size_t tries = 0; tries < kChannels; ++tries) {
    turn_ = (turn_ + 1) % kChannels;
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
  const auto end = questions_.begin() + kChannels;
  const auto at = std::find_if(questions_.begin(), end, [&](const Question& q) { return q.entry == &result.entry(); });
  if (at == end) return;
  const auto channel = static_cast<MotorChannel>(at - questions_.begin());
  if (readings_.full()) ++counters.dropped_readings;
  // fix16: 65536 means no derating.
  readings_.push_back({channel, result.time.count(), result.uncertainty.count(),
                       channel == MotorChannel::derate ? value / 65536 : value});
  if (channel != MotorChannel::speed) return;
  speed_ = value;
  speed_time_ = result.time;
}

std::size_t Polling::take_readings(std::span<MotorReading> out) {
  const std::size_t n = std::min(out.size(), readings_.size());
  std::copy_n(readings_.begin(), n, out.begin());
  readings_.erase_begin(n);
  return n;
}

}  // namespace kphi::iq
