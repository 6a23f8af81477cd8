#include "drivers/sim/supply/circuit.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::sim {

void SupplyCircuit::switch_output(bool on) noexcept {
  output_ = on;
  over_current_s_ = 0;
  if (on) tripped_ = SupplyProtection::none;
}

void SupplyCircuit::trip(SupplyProtection why) noexcept {
  tripped_ = why;
  output_ = false;
}

/// Implicit in time: C dv/dt = i(v) - load - v/R has one solution for any step, since i falls with v.
double SupplyCircuit::step(const SupplyLoad& load, double seconds) noexcept {
  const double c = parameters_.farad / seconds;
  const double g = load.siemens + 1 / parameters_.bleed_ohm;
  const auto voltage_with = [&](double amps) { return (c * volts_ + amps - load.amps) / (c + g); };
  double next = voltage_with(0);
  amps_ = 0;
  limiting_ = false;
  const double volts = std::max(0.0, controls_.volts - sag_volts_);
  if (output_ && next < volts) {
    const double source = 1 / parameters_.source_ohm;
    next = (c * volts_ + source * volts - load.amps) / (c + g + source);
    amps_ = source * (volts - next);
    if (amps_ > controls_.amps) {
      limiting_ = true;
      amps_ = controls_.amps;
      next = voltage_with(amps_);
    }
  }
  volts_ = std::max(0.0, next);
  const double blend = 1 - std::exp(-seconds / parameters_.meter_s);
  shown_volts_ += blend * (volts_ - shown_volts_);
  shown_amps_ += blend * (amps_ - shown_amps_);
  protect(seconds);
  return volts_;
}

void SupplyCircuit::protect(double seconds) noexcept {
  if (!output_) return;
  over_current_s_ = amps_ > controls_.over_amps ? over_current_s_ + seconds : 0;
  if (volts_ > controls_.over_volts) trip(SupplyProtection::over_voltage);
  if (over_current_s_ > parameters_.over_current_delay_s) trip(SupplyProtection::over_current);
}

}  // namespace kphi::sim
