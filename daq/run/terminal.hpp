// The person at the terminal: lines that answer questions, and keys without Enter.
//
// Only what is typed once a question is on the screen answers it: what was typed before is discarded, and that is said
// once. From an answer on nothing is discarded: begin_keys() keeps what was pressed since.
#pragma once

#include <termios.h>

#include <cstdio>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "base/clock.hpp"
#include "daq/run/steering.hpp"

namespace kphi::daq {

/// What the bytes of a terminal mean: arrow up or +, arrow down or -, Enter or h; every other key is stop, and so is
/// the beginning of a sequence that does not continue. Bytes may come in any pieces.
class KeyReader {
 public:
  void take(std::string_view bytes);
  /// Nothing has followed the last bytes for a while: an Esc alone is a key.
  void settle();
  [[nodiscard]] std::optional<Key> next();

 private:
  void take(char byte);
  enum class In { none, escape, sequence } in_ = In::none;
  std::deque<Key> keys_;
};

/// One thread. Called while it waits, `poll` ends the wait by an exception.
class Terminal {
 public:
  using Poll = std::function<void()>;
  struct Answer {
    std::optional<std::string> line;  ///< nullopt: the end of the input
    Duration took{};                  ///< wall time from the question on the screen to its Enter
  };

  /// `input`: a terminal, or a pipe, which has no keys. `words`: where questions are printed.
  Terminal(int input, std::FILE* words) : input_(input), words_(words) {}
  /// The terminal is as it was.
  ~Terminal() { end_keys(); }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  /// Waits without limit, in the background until this program is in the foreground. Ctrl-Z stops the program here, and
  /// afterwards the question is asked again. `printed` is called once the question is on the screen.
  [[nodiscard]] Answer ask(const std::string& question, const std::function<void()>& printed, const Poll& poll);

  /// From now on each key counts by itself, without echo, also those typed since the last answer. Ctrl-C and Ctrl-Z
  /// stay what they are. False: not a terminal in the foreground, so no key will come.
  bool begin_keys();
  void end_keys() noexcept;
  /// Does not wait. A terminal that has hung up, or belongs to another program by now, says stop.
  [[nodiscard]] std::optional<Key> next_key();
  /// Waits until all words are on the screen, then forgets the keys pressed until now: a key is to be an answer.
  void forget_keys(const Poll& poll);

  /// Its keys are this program's, not those of a shell's other job.
  [[nodiscard]] bool is_in_foreground() const;

  /// Ctrl-Z: gives the terminal back, stops this program, and continues as before once it is in the foreground again.
  void suspend();

 private:
  /// Once all words are on the screen. True: something was typed before that.
  [[nodiscard]] bool discard_typed(const Poll& poll);
  /// nullopt at the end of the input, or when Ctrl-Z `suspended` it.
  [[nodiscard]] std::optional<std::string> read_line(const Poll& poll, bool& suspended);

  const int input_;
  std::FILE* const words_;
  bool has_keys_ = false, told_of_typed_ = false;
  termios before_{};
  KeyReader reader_;
};

}  // namespace kphi::daq
