#include "daq/virtual/deterministic_supply.hpp"

#include <algorithm>
#include <utility>

#include "base/error.hpp"

namespace kphi::daq {
namespace {

constexpr Duration kLookEvery = std::chrono::milliseconds(125);
// The driver's: see supply::Timing, and the attempts of ModbusSupply.
constexpr Duration kAnswer = std::chrono::milliseconds(500), kQuiet = std::chrono::milliseconds(150);
constexpr int kAttempts = 3;

}  // namespace

void DeterministicSupply::switch_on(const StopAsked&) {
  if (!slave_.answers(clock_.now()))
    throw DeviceError("simulated supply", "switch on", "no answer", "check that it is on and its baud rate");
  circuit_.controls() = {config_.voltage.value(), config_.current_limit.value(), config_.over_voltage.value(),
                         config_.over_current.value()};
  circuit_.switch_output(true);
}

/// The order is repeated as often as a question.
std::string DeterministicSupply::switch_off() noexcept {
  if (abandoned_) return "";
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    if (slave_.hears(clock_.now())) circuit_.switch_output(false);
    if (slave_.answers(clock_.now())) return "";
  }
  return kNotOff;
}

void DeterministicSupply::look() {
  const Instant now = clock_.now();
  if (!under_way_.empty() && now >= due_) readings_.push_back(std::exchange(under_way_, {}).front());
  if (now < next_look_ || !failure_.empty()) return;
  next_look_ = now + kLookEvery;
  const auto wait = slave_.answers(now);
  if (!wait || *wait > kAnswer) return miss();
  missed_ = 0;
  if (*wait == Duration{0}) return readings_.push_back(shown(*wait));
  due_ = now + *wait;
  next_look_ = std::max(next_look_, due_);
  under_way_ = {shown(*wait)};
}

void DeterministicSupply::miss() {
  next_look_ = clock_.now() + kAnswer + kQuiet;
  if (++missed_ < kAttempts) return;
  failure_ = "supply: read: no answer";
  if (const std::string why = switch_off(); !why.empty()) failure_ += "; " + why;
}

SupplyReading DeterministicSupply::shown(Duration wait) const {
  return {(clock_.now() + wait / 2).count(),
          (wait / 2).count(),
          circuit_.shown_volts(),
          circuit_.shown_amps(),
          circuit_.controls().volts,
          circuit_.controls().amps,
          circuit_.limiting() ? SupplyRegulation::constant_current : SupplyRegulation::constant_voltage,
          circuit_.tripped(),
          circuit_.output() ? 1u : 0u};
}

std::size_t DeterministicSupply::take(std::span<SupplyReading> out) {
  const std::size_t n = std::min(out.size(), readings_.size());
  std::copy_n(readings_.begin(), n, out.begin());
  readings_.erase(readings_.begin(), readings_.begin() + static_cast<std::ptrdiff_t>(n));
  return n;
}

}  // namespace kphi::daq
