// The power side of a bench supply: a source behind a resistance, a limit of the current, an output capacitor, two
// thresholds. It cannot take current back: what the load feeds back charges the capacitor.
//
// Coupling to a motor, once per tick: terminal voltage = circuit.step({the motor's supply current}, tick).
#pragma once

#include "base/device_data.hpp"

namespace kphi::sim {

struct SupplyParameters {
  double source_ohm = 0.020;  ///< source and leads
  double farad = 1270e-6;     ///< at the terminals, with the 270 µF that come with the motor
  double bleed_ohm = 1000;    ///< across the terminals, always
  double over_current_delay_s = 0.002;
  double meter_s = 0.05;  ///< time constant of what is displayed
};

/// The load on the terminals: a current and a conductance. Negative amperes feed back.
struct SupplyLoad {
  double amps = 0;
  double siemens = 0;
};

struct SupplyControls {
  double volts = 5, amps = 1;               ///< set voltage, limit of the current
  double over_volts = 62, over_amps = 6.2;  ///< thresholds
};

class SupplyCircuit {
 public:
  explicit SupplyCircuit(const SupplyParameters& parameters = {}) noexcept : parameters_(parameters) {}

  [[nodiscard]] SupplyControls& controls() noexcept { return controls_; }
  [[nodiscard]] const SupplyControls& controls() const noexcept { return controls_; }
  /// Switching on clears the trip.
  void switch_output(bool on) noexcept;
  void trip(SupplyProtection why) noexcept;
  /// From now on the source stays this far below its set voltage.
  void sag(double volts) noexcept { sag_volts_ = volts; }

  /// Returns the voltage at the terminals after `seconds` with this load, V; never negative.
  double step(const SupplyLoad& load, double seconds) noexcept;

  [[nodiscard]] bool output() const noexcept { return output_; }
  [[nodiscard]] bool limiting() const noexcept { return limiting_; }  ///< constant current
  [[nodiscard]] SupplyProtection tripped() const noexcept { return tripped_; }
  [[nodiscard]] double volts() const noexcept { return volts_; }  ///< at the terminals, now
  [[nodiscard]] double amps() const noexcept { return amps_; }    ///< out of the supply, now; never negative
  [[nodiscard]] double shown_volts() const noexcept { return shown_volts_; }  ///< by its meter
  [[nodiscard]] double shown_amps() const noexcept { return shown_amps_; }    ///< by its meter

 private:
  void protect(double seconds) noexcept;

  SupplyParameters parameters_;
  SupplyControls controls_;
  bool output_ = false, limiting_ = false;
  SupplyProtection tripped_ = SupplyProtection::none;
  double volts_ = 0, amps_ = 0, shown_volts_ = 0, shown_amps_ = 0;
  double sag_volts_ = 0;
  double over_current_s_ = 0;
};

}  // namespace kphi::sim
