#include "daq/run/terminal.hpp"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

#include "daq/guard/run_stopped.hpp"
#include "daq/run/console.hpp"

namespace kphi::daq {
namespace {

constexpr std::chrono::milliseconds kPoll{20};
constexpr std::size_t kLongestLine = 1024;  // bytes; the rest of a line is ignored

/// Until the words are on the screen: what the console still holds, nobody has read.
void await_printed(const Terminal::Poll& poll) {
  while (!console().finish(kPoll)) poll();
}

}  // namespace

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

bool Terminal::is_in_foreground() const {
  const pid_t foreground = ::tcgetpgrp(input_);
  return foreground < 0 || foreground == ::getpgrp();  // < 0: nobody controls jobs there
}

bool Terminal::discard_typed(const Poll& poll) {
  await_printed(poll);
  if (::isatty(input_) != 0) {
    // From the background this would stop the program, and empty what the shell is to read.
    for (; !is_in_foreground(); poll()) ::poll(nullptr, 0, static_cast<int>(kPoll.count()));
    int waiting = 0;
    const bool was_typed = ::ioctl(input_, FIONREAD, &waiting) == 0 && waiting > 0;
    ::tcflush(input_, TCIFLUSH);
    return was_typed;
  }
  bool was_typed = false;
  std::array<char, 256> rubbish;
  for (pollfd ready{input_, POLLIN, 0}; ::poll(&ready, 1, 0) > 0 && (ready.revents & POLLIN) != 0;) {
    if (::read(input_, rubbish.data(), rubbish.size()) <= 0) break;
    was_typed = true;
  }
  return was_typed;
}

std::optional<std::string> Terminal::read_line(const Poll& poll, bool& suspended) {
  std::string line;
  for (;;) {
    const bool mine = is_in_foreground();
    pollfd waiting{mine ? input_ : -1, POLLIN, 0};
    const int ready = ::poll(&waiting, 1, static_cast<int>(kPoll.count()));
    if ((suspended = SignalWatch::take_suspension())) return std::nullopt;
    poll();
    if (ready <= 0) continue;
    char c = 0;
    const ssize_t n = ::read(input_, &c, 1);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return std::nullopt;
    if (c == '\n') return line;
    if (c != '\r' && line.size() < kLongestLine) line += c;
  }
}

Terminal::Answer Terminal::ask(const std::string& question, const std::function<void()>& printed, const Poll& poll) {
  put(words_, question);
  if (discard_typed(poll) && !std::exchange(told_of_typed_, true)) {
    put(words_, "\nWhat was typed before the question does not count.\n" + question);
    (void)discard_typed(poll);
  }
  put(words_, " ");  // whoever waits for this blank may type
  printed();
  for (;;) {
    const auto since = std::chrono::steady_clock::now();
    bool suspended = false;
    std::optional<std::string> line = read_line(poll, suspended);
    if (!suspended) return {std::move(line), std::chrono::steady_clock::now() - since};
    suspend();
    put(words_, question);
    (void)discard_typed(poll);
    put(words_, " ");
  }
}

bool Terminal::begin_keys() {
  if (has_keys_) return true;
  if (::isatty(input_) == 0 || !is_in_foreground() || ::tcgetattr(input_, &before_) != 0) return false;
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  return has_keys_ = ::tcsetattr(input_, TCSANOW, &raw) == 0;
}

void Terminal::end_keys() noexcept {
  // From the background it would stop this program, and change what the shell has set.
  if (std::exchange(has_keys_, false) && is_in_foreground()) ::tcsetattr(input_, TCSAFLUSH, &before_);
}

std::optional<Key> Terminal::next_key() {
  if (!has_keys_) return std::nullopt;
  if (!is_in_foreground()) return Key::stop;
  pollfd waiting{input_, POLLIN, 0};
  if (::poll(&waiting, 1, 0) > 0) {
    std::array<char, 64> bytes{};
    const ssize_t n = ::read(input_, bytes.data(), bytes.size());
    if (n <= 0) return (waiting.revents & (POLLHUP | POLLERR)) != 0 ? std::optional(Key::stop) : std::nullopt;
    reader_.take({bytes.data(), static_cast<std::size_t>(n)});
  } else if (auto key = reader_.next()) {
    return key;
  } else {
    reader_.settle();
  }
  return reader_.next();
}

void Terminal::forget_keys(const Poll& poll) {
  await_printed(poll);
  if (has_keys_) ::tcflush(input_, TCIFLUSH);
  reader_ = {};
}

void Terminal::suspend() {
  const bool had_keys = has_keys_;
  end_keys();
  SignalWatch::suspend();
  if (had_keys) begin_keys();
}

}  // namespace kphi::daq
