#include "daq/hardware/terminal_watch.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/thread.hpp"

namespace kphi::daq {
namespace {

constexpr int kEvery_ms = 20;

std::int64_t steady_ns() { return std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1); }

/// Both ends of a pseudo-terminal that changes no byte; invalid ones if there is none to be had.
std::pair<Descriptor, Descriptor> pseudo_terminal() {
  Descriptor in(::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
  std::array<char, 64> name{};
  if (in.number() < 0 || ::grantpt(in.number()) != 0 || ::unlockpt(in.number()) != 0 ||
      ::ptsname_r(in.number(), name.data(), name.size()) != 0)
    return {};
  Descriptor out(::open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
  termios raw{};
  if (out.number() < 0 || ::tcgetattr(out.number(), &raw) != 0) return {};
  ::cfmakeraw(&raw);
  if (::tcsetattr(out.number(), TCSANOW, &raw) != 0) return {};
  return {std::move(in), std::move(out)};
}

}  // namespace

TerminalWatch::TerminalWatch() : TerminalWatch(pseudo_terminal()) {}

TerminalWatch::TerminalWatch(std::pair<Descriptor, Descriptor> ends)
    : in_(std::move(ends.first)), out_(std::move(ends.second)) {
  if (in_.number() >= 0) thread_ = start_thread({"terminals", true}, [this] { watch(); });
}

TerminalWatch::~TerminalWatch() {
  quit_.raise();
  if (thread_.joinable()) thread_.join();
}

Duration TerminalWatch::late() const noexcept {
  const std::int64_t sent = sent_ns_, last = last_ns_;
  return Duration(std::max(last, sent == 0 ? 0 : steady_ns() - sent));
}

void TerminalWatch::watch() noexcept {
  std::array<pollfd, 2> both{{{quit_.descriptor(), POLLIN, 0}, {out_.number(), POLLIN, 0}}};
  for (;;) {
    const std::int64_t sent = steady_ns();
    sent_ns_ = sent;
    const char byte = 0;
    if (::write(in_.number(), &byte, 1) != 1) break;
    ::poll(both.data(), both.size(), -1);
    if (both[0].revents != 0) break;
    std::array<char, 16> heard;
    if (::read(out_.number(), heard.data(), heard.size()) <= 0) break;
    last_ns_ = steady_ns() - sent;
    sent_ns_ = 0;
    if (::poll(both.data(), 1, kEvery_ms) > 0) break;
  }
  sent_ns_ = last_ns_ = 0;
}

}  // namespace kphi::daq
