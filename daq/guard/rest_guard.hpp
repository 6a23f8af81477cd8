// Watches the bench between runs, in a thread of its own, while a person may be working at it: the rotor must stay at
// rest.
//
// Trips if the rotor turns, if its module drives or brakes it, if a supply that kphi controls has its output on
// unexpectedly, or if this computer slept; then it coasts the motor and cuts the supply. A module that does not answer,
// for example because its power was cut by hand, does not trip.
#pragma once

#include <atomic>
#include <functional>
#include <memory>

#include "daq/bench/bench.hpp"
#include "daq/guard/interlock.hpp"

namespace kphi::daq {

inline constexpr RadPerSec kStandstill{5.0};         ///< slower: at rest
inline constexpr double kSpinDownLimitSeconds = 30;  ///< a coasting rotor is at rest by then
inline constexpr const char* kKeepAway = "keep away; wait until the rotor is at rest, or cut its power at the switch";
/// The rotor coasts, but did not come to rest within that time.
[[nodiscard]] SafetyStop still_turning(RadPerSec speed);

class RestGuard {
 public:
  /// Takes all readings of the bench, which must outlive this. `motor_has_power`: as far as the bench knows.
  RestGuard(Bench& bench, bool motor_has_power);

  /// Returns once a reading taken from now on shows the rotor at rest. Throws SafetyStop after a trip, if the rotor
  /// still turns after 30 s, or if its speed cannot be read; Interrupted if `stop_asked`.
  void await_rest(const std::function<bool()>& stop_asked);
  /// Throws SafetyStop after a trip. Any thread.
  void check() const { latch_.check(); }

 private:
  void poll() noexcept;
  void take_readings();
  void judge(const MotorReading& reading);
  void take_supply();
  void trip(Trip found) noexcept;

  Bench& bench_;
  const bool motor_has_power_;
  const Instant begun_;
  Latch latch_;
  std::atomic<bool> resting_{false};       ///< a turning rotor is a trip from now on
  std::atomic<double> speed_rad_s_{0};     ///< unsigned
  std::atomic<std::int64_t> speed_at_ns_;  ///< bench time of that speed
  std::shared_ptr<void> polling_;          ///< last member: destroyed first
};

}  // namespace kphi::daq
