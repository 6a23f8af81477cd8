// When the bench must stop by itself. A trip is a value; the first one is latched. Two kinds of trip have no limit: a
// computer that slept, and a supply that reports trouble.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.hpp"
#include "daq/guard/guard_limits.hpp"
#include "daq/guard/run_stopped.hpp"
#include "profiles/bench_config.hpp"

namespace kphi::daq {

/// Why the motor was coasted.
struct Trip {
  std::string reason{};              ///< one line: "thrust 21.3 N is above 20 N (campaign limits.thrust_max_n)"
  Source source = Source::guard;     ///< what reported it, or failed
  Watched watched = Watched::state;  ///< state: no limit; a device reported trouble
  bool link_failed = false;          ///< no reading, but the link to the source reported it
  SupplyProtection protection = SupplyProtection::none;  ///< that switched the supply's output off
  Instant noticed{0};                                    ///< bench time
  int step = -1;                                         ///< 0-based, -1 outside steps
};

/// `value` has passed `limit`.
[[nodiscard]] Trip passed(const GuardLimit& limit, double value);

/// Holds the first trip. Thread-safe, without waiting.
class Latch {
 public:
  /// True: it was the first.
  bool set(Trip trip) noexcept;
  /// nullptr before the first.
  [[nodiscard]] const Trip* trip() const noexcept { return state_.load() == State::closed ? &trip_ : nullptr; }
  /// Throws SafetyStop with the reason.
  void check() const;

 private:
  enum class State : int { open, closing, closed };
  std::atomic<State> state_{State::open};
  Trip trip_;  // written while closing, read once closed
};

/// What the person at the stand should do about it.
[[nodiscard]] std::string next_move(const Trip& trip);

/// A trip that stopped a run.
class SafetyStop final : public RunStopped {
 public:
  explicit SafetyStop(StopWords words) : RunStopped(std::move(words), ExitCode::safety_stop) {}
  explicit SafetyStop(const std::string& cause, const std::string& next_move = {})
      : SafetyStop(StopWords{.cause = cause, .next_move = next_move}) {}
  explicit SafetyStop(const Trip& trip);
  /// A trip of the guard; false: an error of the runner, perhaps because of a trip.
  [[nodiscard]] bool is_trip() const noexcept { return is_trip_; }

 private:
  bool is_trip_ = false;
};

/// This computer slept since the clock's epoch. Meanwhile the bench was unwatched, and the module has coasted the motor
/// by its own timeout: nothing may turn until a person has looked at the stand.
[[nodiscard]] inline bool has_slept(const Clock& clock) noexcept { return clock.suspended() >= kShortestSleep; }
[[nodiscard]] Trip slept(const Clock& clock);
/// Throws SafetyStop if this computer slept.
void require_awake(const Clock& clock);

/// "supply: over-current protection switched the output off".
[[nodiscard]] std::string tripped_words(const SupplyReading& seen);

/// Checks one reading while the motor may turn: protection, output, settings changed on the front panel; and, once the
/// speed has `settled`, constant current, sag and rise, which a change of speed may bring. nullopt: no trip.
[[nodiscard]] std::optional<Trip> check(const SupplyReading& seen, const profiles::SupplyConfig& wanted, bool settled);

/// In a handler: switches the output off, and throws again what is handled. If the supply does not confirm it, what is
/// thrown says so: an Interrupted or SafetyStop stays one, another error becomes a RunStopped with its exit code.
/// nullptr: throws it again as it is.
[[noreturn]] void rethrow_without_power(SupplyLink* supply);

/// Runs `work`, then switches the motor's power off for good, also when `work` throws. The motor must be at rest by
/// then. Throws SafetyStop for a supply that does not confirm it, and as rethrow_without_power.
void leave_without_power(Bench& bench, const std::function<void()>& work);

/// Power of a bench's motor: on when this is made and until it is destroyed, except from off() to restore(). One
/// thread.
class MotorPower {
 public:
  /// `supply` outlives this; nullptr: kphi does not control the power. Throws DeviceError.
  MotorPower(SupplyLink* supply, const StopAsked& stop_asked);
  /// See Bench::switch_off_power.
  [[nodiscard]] bool off(MotorLink& motor);
  /// See Bench::restore_power. `wait_for_voltage`: for a supply that does not wait by itself. Throws SafetyStop,
  /// Interrupted, too.
  void restore(
      MotorLink& motor, const Clock& clock, const StopAsked& stop_asked,
      const std::function<void()>& wait_for_voltage = [] {});

 private:
  void switch_on(const StopAsked& stop_asked);

  SupplyLink* supply_;
  std::unique_ptr<OutputEnable> on_;
};

}  // namespace kphi::daq
