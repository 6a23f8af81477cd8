// How a run ends early: in words for the person at the stand, in the order of their need, and by signals.
#pragma once

#include <cstdint>
#include <exception>
#include <string>
#include <utility>

#include "base/error.hpp"
#include "daq/bench/stop_asked.hpp"

namespace kphi::daq {

/// A failing link to the motor reports itself twice: as a failure, and as the motor's first event that ends a run.
enum class MotorFailure : std::uint8_t {
  none,           ///< something else stopped the run
  event_to_come,  ///< the failure stopped the run; the event still has to be skipped
  reported,       ///< the event stopped the run, or was skipped
};

struct StopWords {
  std::string cause{};         ///< what stopped the run
  std::string next_move{};     ///< what to do; may be empty
  std::string consequences{};  ///< what else the devices reported; may be empty
  std::string data{};          ///< where the data are, and how to continue; empty if nothing was recorded
  std::string state{};         ///< of motor and supply; empty if neither was switched on
  MotorFailure motor_failure = MotorFailure::none;
  bool at_rest = false;  ///< the rotor was seen at rest, or has not turned

  /// Adds a further report to the consequences; an empty one is ignored.
  void also(const std::string& text);
  /// Adds to the state of motor and supply.
  void leaves(const std::string& text);
  /// One line for records: cause, consequences, state.
  [[nodiscard]] std::string line() const;
  /// `headline`: "SAFETY STOP". One line each: cause, next move, data, state.
  [[nodiscard]] std::string text(const std::string& headline) const;
};

/// Thrown when the motor coasts already.
class RunStopped : public Error {
 public:
  RunStopped(StopWords words, ExitCode exit_code) : Error(words.line(), exit_code), words_(std::move(words)) {}
  [[nodiscard]] const StopWords& words() const noexcept { return words_; }

 private:
  StopWords words_;
};

/// Thrown by the runner when a person or the system asks it to stop.
class Interrupted : public RunStopped {
 public:
  explicit Interrupted(StopWords words) : RunStopped(std::move(words), ExitCode::interrupted) {}
  explicit Interrupted(const std::string& cause) : Interrupted(StopWords{.cause = cause}) {}
};

/// Throws Interrupted if a stop is asked for. `when`: "before anything was switched on".
void require_no_stop(const StopAsked& stop_asked, const char* when);

/// Words of any exception; an exception other than RunStopped has only a cause, its message.
[[nodiscard]] StopWords words_of(const std::exception_ptr& cause);

/// The exception as an `Expected`; nullptr if it has another type. Valid while `cause` lives.
template <class Expected>
[[nodiscard]] const Expected* as(const std::exception_ptr& cause) {
  try {
    std::rethrow_exception(cause);
  } catch (const Expected& expected) {
    return &expected;
  } catch (...) {
    return nullptr;
  }
}

/// While it lives, SIGINT, SIGTERM, SIGHUP and SIGQUIT are only counted, and Ctrl-Z is only noted; the runner checks
/// both on every tick. Afterwards they act as before.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  /// How many arrived. Any thread.
  [[nodiscard]] static int count() noexcept;
  /// Ctrl-Z, which must wait until nothing can turn. Any thread.
  [[nodiscard]] static bool is_suspension_asked() noexcept;
  /// True: it was asked for, and the caller suspends.
  [[nodiscard]] static bool take_suspension() noexcept;
  /// Stops this program as Ctrl-Z does; returns once it continues. At once where no shell controls jobs.
  static void suspend() noexcept;
};

}  // namespace kphi::daq
