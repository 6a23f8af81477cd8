// Keys of a terminal without Enter and without echo, while this lives.
#pragma once

#include <termios.h>

#include <deque>
#include <optional>
#include <string_view>

#include "daq/run/steering.hpp"

namespace kphi::daq {

/// What the bytes of a terminal mean: arrow up or +, arrow down or -, Enter or h; every other key is stop, and so is
/// the beginning of a sequence that does not go on. Bytes may come in any pieces.
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

class Keyboard {
 public:
  /// `descriptor`: a terminal, else there are no keys. Ctrl-C and Ctrl-Z stay what they are.
  explicit Keyboard(int descriptor);
  ~Keyboard();
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;

  [[nodiscard]] bool is_there() const noexcept { return is_there_; }
  /// Does not wait. A terminal that has hung up stops.
  [[nodiscard]] std::optional<Key> next();

 private:
  const int descriptor_;
  bool is_there_ = false;
  termios before_{};
  KeyReader reader_;
};

}  // namespace kphi::daq
