// A run that ended early, in words for the person at the stand, in the order of their need.
#pragma once

#include <exception>
#include <string>
#include <utility>

#include "base/error.hpp"

namespace kphi::daq {

struct StopWords {
  std::string cause;         ///< what stopped the run
  std::string consequences;  ///< what else the devices reported; may be empty
  std::string next_move;     ///< what to do; may be empty
  std::string data;          ///< where the data are, and how to continue; empty if nothing was recorded
  std::string state;         ///< of motor and supply; empty if neither was switched on

  /// Adds a further report, unless the cause says it already. `text` may begin with its time, "3.210 s: ".
  void also(const std::string& text);
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

/// Words of any exception; an exception other than RunStopped has only a cause, its message.
[[nodiscard]] StopWords words_of(const std::exception_ptr& cause);

/// Adds `text` to `said`, unless it says nothing new.
void add_words(std::string& said, const std::string& text);

}  // namespace kphi::daq
