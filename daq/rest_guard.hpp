// Watches a bench at which a person may be at work, between runs: the rotor must stay at rest. In a thread of its own,
// as the guard of a run.
//
// Trips when the rotor turns, when its module drives or brakes it, when a supply of ours has its output on without
// having been asked, and when this computer slept; then it lets the motor go and cuts the supply. A module that does
// not answer, for example because its power was cut by hand, does not trip.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>

#include "daq/bench.hpp"
#include "daq/interlock.hpp"

namespace kphi::daq {

inline constexpr RadPerSec kStandstill{5.0};         ///< slower: at rest
inline constexpr double kSpinDownLimitSeconds = 30;  ///< a rotor that coasts is at rest by then

class RestGuard {
 public:
  /// `motor_has_power`: as far as the bench knows. The bench outlives this. Takes all its readings.
  RestGuard(Bench& bench, bool motor_has_power);
  RestGuard(const RestGuard&) = delete;
  RestGuard& operator=(const RestGuard&) = delete;

  /// Returns once a reading taken from now on shows the rotor at rest. `stop_asked` is asked meanwhile. Throws
  /// SafetyStop after a trip, when the rotor still turns after 30 s, and when nobody can tell; Interrupted.
  void await_rest(const std::function<bool()>& stop_asked);
  /// Throws SafetyStop after a trip. Any thread.
  void check() const;

 private:
  void look() noexcept;
  void take_readings();
  void judge(const results::MotorReading& reading);
  void take_supply();
  void trip(Trip found) noexcept;
  void trip_state(const std::string& reason) noexcept;

  Bench& bench_;
  const bool motor_has_power_;
  const Instant begun_;
  Latch latch_;
  std::atomic<bool> resting_{false};       ///< a turning rotor is a trip from now on
  std::atomic<double> speed_rad_s_{0};     ///< unsigned
  std::atomic<std::int64_t> speed_at_ns_;  ///< of it
  std::unique_ptr<Background> looking_;    ///< goes first
};

}  // namespace kphi::daq
