// A run that ended early, in the words that a person at the stand needs, in that order.
#pragma once

#include <exception>
#include <stdexcept>
#include <string>

namespace kphi::daq {

struct StopWords {
  std::string cause;         ///< what stopped the run
  std::string consequences;  ///< what else the devices told; empty: nothing
  std::string next_move;     ///< what to do; empty: nothing special
  std::string data;          ///< where the data are, and how to continue; empty: nothing was recorded
  std::string state;         ///< what motor and supply did; empty: neither was switched on

  /// Adds what else was told, unless the cause says it already. `text` may begin with its time, "3.210 s: ".
  void also(const std::string& text);
  /// One line for records: cause, consequences, state.
  [[nodiscard]] std::string line() const;
  /// `headline`: "SAFETY STOP". One line each: cause, next move, data, state.
  [[nodiscard]] std::string text(const std::string& headline) const;
};

/// The motor coasts already.
class RunStopped : public std::runtime_error {
 public:
  explicit RunStopped(StopWords words) : std::runtime_error(words.line()), words_(std::move(words)) {}
  [[nodiscard]] const StopWords& words() const noexcept { return words_; }

 private:
  StopWords words_;
};

/// Of any exception; of another than RunStopped: its message as the cause.
[[nodiscard]] StopWords words_of(const std::exception_ptr& cause);

/// `text` beside `said`, unless it says nothing new.
void add_words(std::string& said, const std::string& text);

}  // namespace kphi::daq
