#include "daq/spin/keyboard.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>

namespace kphi::daq {

void KeyReader::take(std::string_view bytes) {
  for (const char byte : bytes) take(byte);
}

void KeyReader::take(char byte) {
  constexpr char kEscape = '\x1b';
  if (in_ == In::escape && (byte == '[' || byte == 'O')) {
    in_ = In::sequence;
    return;
  }
  if (in_ == In::escape) keys_.push_back(Key::stop);  // it was a key of its own
  const bool ends_sequence = std::exchange(in_, In::none) == In::sequence;
  if (byte == kEscape) {
    in_ = In::escape;
    return;
  }
  const auto meaning = [&] {
    if (ends_sequence) return byte == 'A' ? Key::up : byte == 'B' ? Key::down : Key::stop;
    if (byte == '+') return Key::up;
    if (byte == '-') return Key::down;
    return byte == '\n' || byte == '\r' || byte == 'h' ? Key::hold : Key::stop;
  };
  keys_.push_back(meaning());
}

void KeyReader::settle() {
  if (std::exchange(in_, In::none) != In::none) keys_.push_back(Key::stop);
}

std::optional<Key> KeyReader::next() {
  if (keys_.empty()) return std::nullopt;
  const Key key = keys_.front();
  keys_.pop_front();
  return key;
}

Keyboard::Keyboard(int descriptor) : descriptor_(descriptor) {
  if (isatty(descriptor) == 0 || tcgetattr(descriptor, &before_) != 0) return;
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  is_there_ = tcsetattr(descriptor, TCSAFLUSH, &raw) == 0;  // what was typed before does not count
}

Keyboard::~Keyboard() {
  if (is_there_) tcsetattr(descriptor_, TCSAFLUSH, &before_);
}

std::optional<Key> Keyboard::next() {
  if (!is_there_) return std::nullopt;
  pollfd waiting{descriptor_, POLLIN, 0};
  if (::poll(&waiting, 1, 0) > 0) {
    std::array<char, 64> bytes{};
    const ssize_t n = ::read(descriptor_, bytes.data(), bytes.size());
    if (n <= 0) return (waiting.revents & (POLLHUP | POLLERR)) != 0 ? std::optional(Key::stop) : std::nullopt;
    reader_.take({bytes.data(), static_cast<std::size_t>(n)});
  } else if (auto key = reader_.next()) {
    return key;
  } else {
    reader_.settle();
  }
  return reader_.next();
}

}  // namespace kphi::daq
