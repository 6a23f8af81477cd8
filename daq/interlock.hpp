// When the bench must stop by itself. A trip is a value; the runner turns it into a stop.
#pragma once

#include <optional>
#include <stdexcept>
#include <string>

#include "daq/speed_error.hpp"
#include "drivers/clock.hpp"
#include "profiles/campaign.hpp"
#include "results/records.hpp"

namespace kphi::daq {

/// What the bench shows at one moment. A negative age: nothing came yet.
struct Observation {
  RadPerSec speed;  ///< unsigned
  Newtons thrust;   ///< zero subtracted
  Amperes supply_current;
  Celsius coil_temperature;
  Duration load_cell_age{};
  Duration motor_age{};
  double derate = 1;               ///< share of its drive that the module allows itself; 1: all
  unsigned fault_bits = 0;         ///< of power_safety.fault_now
  SpeedError speed_error{};        ///< of speed against command
  bool load_cell_is_fresh = true;  ///< no older than the stream's and this host's delay: thrust is what is now
  bool motor_is_fresh = true;      ///< likewise, of speed, current and temperature
  // For onlookers.
  NewtonMetres torque{};             ///< about the thrust axis, zero subtracted
  Volts module_voltage{};            ///< at the motor module's input
  results::SupplyReading supply{};   ///< of the bench supply; time 0: nothing yet, or there is none
  results::SampleAccount account{};  ///< of this run so far
};

/// A limit that was passed, in words: "thrust 21.3 N is above 20 N".
struct Trip {
  std::string reason;
};

/// Of what was measured, of what the module says of itself, and whether its rotor does what it is told.
[[nodiscard]] std::optional<Trip> check(const Observation& seen, const profiles::Limits& limits);
/// Ages above `patience`, bench time.
[[nodiscard]] std::optional<Trip> check_ages(const Observation& seen, Duration patience);

/// A trip that stopped a run. The motor coasts already. Exit code 4.
class SafetyStop : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kphi::daq
