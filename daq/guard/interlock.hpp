// When the bench must stop by itself. A trip is a value; the first one is latched.
#pragma once

#include <atomic>
#include <string>

#include "base/clock.hpp"
#include "daq/guard/guard_limits.hpp"
#include "daq/guard/run_stopped.hpp"
#include "results/records.hpp"

namespace kphi::daq {

/// Why the motor was coasted.
struct Trip {
  std::string reason;                ///< one line: "thrust 21.3 N is above 20 N (campaign limits.thrust_max_n)"
  Source source = Source::guard;     ///< who told it, or failed
  Watched watched = Watched::state;  ///< state: no limit; what a device says of itself
  results::SupplyProtection protection = results::SupplyProtection::none;  ///< which switched the supply off by itself
  double value = 0;                                                        ///< unit of the limit
  GuardLimit limit{};                                                      ///< that was passed
  Instant sample{0};   ///< bench time of the sample or reading; after silence of the last one
  Instant noticed{0};  ///< bench time
  int step = -1;       ///< 0-based, -1 outside steps
};

/// `value` has passed `limit`.
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

/// What a person should do about it.
[[nodiscard]] std::string next_move(const Trip& trip);

/// A trip that stopped a run.
class SafetyStop final : public RunStopped {
 public:
  explicit SafetyStop(StopWords words) : RunStopped(std::move(words), ExitCode::safety_stop) {}
  explicit SafetyStop(const std::string& cause, const std::string& next_move = {})
      : SafetyStop(StopWords{cause, {}, next_move, {}, {}}) {}
  explicit SafetyStop(const Trip& trip) : SafetyStop(trip.reason, next_move(trip)) { is_trip_ = true; }
  /// The guard's own trip, not what the runner met because of it.
  [[nodiscard]] bool is_trip() const noexcept { return is_trip_; }

 private:
  bool is_trip_ = false;
};

}  // namespace kphi::daq
