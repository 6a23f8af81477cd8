// When the bench must stop by itself. A trip is a value, and the first one holds: it is latched.
#pragma once

#include <array>
#include <atomic>
#include <string>

#include "daq/guard_limits.hpp"
#include "daq/run_stopped.hpp"
#include "drivers/clock.hpp"
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
  bool load_cell_is_fresh = true;  ///< no older than the stream's and this host's delay: thrust is what is now
  bool motor_is_fresh = true;      ///< likewise, of speed, current and temperature
  // For onlookers.
  double derate = 1;                 ///< share of its drive that the module allows itself; 1: all
  unsigned fault_bits = 0;           ///< of power_safety.fault_now
  NewtonMetres torque{};             ///< about the thrust axis, zero subtracted
  Volts module_voltage{};            ///< at the motor module's input
  Amperes motor_current{};           ///< the module's estimate
  std::array<double, 6> loads{};     ///< on the cell, its zero included; see borne_loads
  results::SupplyReading supply{};   ///< of the bench supply; time 0: nothing yet, or there is none
  results::SampleAccount account{};  ///< of this run so far
};

/// Why the motor was let go.
struct Trip {
  std::string reason;                ///< one line: "thrust 21.3 N is above 20 N (campaign limits.thrust_max_n)"
  Watched watched = Watched::state;  ///< state: there is no limit; what a device says of itself
  double value = 0;                  ///< unit of the limit
  GuardLimit limit{};                ///< what was passed
  Instant sample{0};                 ///< bench time of the sample or reading; of silence: of the last one
  Instant noticed{0};                ///< bench time
  int step = -1;                     ///< 0-based, -1 outside steps
};

/// `value` has passed `limit`, in words.
[[nodiscard]] Trip passed(const GuardLimit& limit, double value, Instant sample);

/// Holds the first trip. Any thread; nobody waits.
class Latch {
 public:
  /// True: it was the first.
  bool set(Trip trip) noexcept;
  /// nullptr: none yet.
  [[nodiscard]] const Trip* trip() const noexcept;
  /// Throws SafetyStop with the reason.
  void check() const;

 private:
  enum class State : int { open, closing, closed };
  std::atomic<State> state_{State::open};
  Trip trip_;  // written while closing, read once closed
};

/// What a person does about it.
[[nodiscard]] std::string next_move(const Trip& trip);

/// A trip that stopped a run. Exit code 4.
class SafetyStop final : public RunStopped {
 public:
  using RunStopped::RunStopped;
  explicit SafetyStop(const std::string& cause, const std::string& next_move = {})
      : RunStopped({cause, {}, next_move, {}, {}}) {}
  explicit SafetyStop(const Trip& trip) : SafetyStop(trip.reason, next_move(trip)) {}
};

}  // namespace kphi::daq
