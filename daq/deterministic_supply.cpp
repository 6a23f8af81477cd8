#include "daq/deterministic_supply.hpp"

#include <algorithm>

namespace kphi::daq {
namespace {

constexpr Duration kLookEvery = std::chrono::milliseconds(125);

/// The simulator has its own enum; the file's code is told here.
results::SupplyProtection to_protection(sim::SupplyTrip trip) {
  using results::SupplyProtection;
  switch (trip) {
    case sim::SupplyTrip::none:
      return SupplyProtection::none;
    case sim::SupplyTrip::over_voltage:
      return SupplyProtection::over_voltage;
    case sim::SupplyTrip::over_current:
      return SupplyProtection::over_current;
    case sim::SupplyTrip::over_power:
      return SupplyProtection::over_power;
    case sim::SupplyTrip::over_temperature:
      return SupplyProtection::over_temperature;
    case sim::SupplyTrip::short_circuit:
      return SupplyProtection::short_circuit;
  }
  return SupplyProtection::unknown;
}

}  // namespace

void DeterministicSupply::switch_on() {
  circuit_.controls() = {place_.voltage.value(), place_.current_limit.value(), place_.over_voltage.value(),
                         place_.over_current.value()};
  circuit_.switch_output(true);
}

std::string DeterministicSupply::switch_off() noexcept {
  if (!abandoned_) circuit_.switch_output(false);
  return "";
}

void DeterministicSupply::look() {
  if (clock_.now() < next_look_) return;
  next_look_ = clock_.now() + kLookEvery;
  readings_.push_back(
      {clock_.now().count(), 0, circuit_.shown_volts(), circuit_.shown_amps(), circuit_.controls().volts,
       circuit_.controls().amps,
       circuit_.limiting() ? results::SupplyRegulation::constant_current : results::SupplyRegulation::constant_voltage,
       to_protection(circuit_.tripped()), circuit_.output() ? 1u : 0u});
}

std::size_t DeterministicSupply::take(std::span<results::SupplyReading> out) {
  const std::size_t n = std::min(out.size(), readings_.size());
  std::copy_n(readings_.begin(), n, out.begin());
  readings_.erase(readings_.begin(), readings_.begin() + static_cast<std::ptrdiff_t>(n));
  return n;
}

}  // namespace kphi::daq
