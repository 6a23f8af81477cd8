// How late this computer hands on what its serial ports hear. The kernel does that in a thread of its own, at the usual
// priority: beside programs that compute, readings came 0.2 s late, whatever the priority of this program. So a byte
// goes through a pseudo-terminal, which the same kernel thread serves, again and again.
#pragma once

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include "base/clock.hpp"
#include "base/descriptor.hpp"

namespace kphi::daq {

class TerminalWatch {
 public:
  /// Without a pseudo-terminal it sees nothing.
  TerminalWatch();
  /// Of this pair, for tests: what is written to the first is heard at the second.
  explicit TerminalWatch(std::pair<Descriptor, Descriptor> ends);
  ~TerminalWatch();
  TerminalWatch(const TerminalWatch&) = delete;
  TerminalWatch& operator=(const TerminalWatch&) = delete;

  /// By how much a byte is late now, or the last one was, wall time. Any thread, without waiting.
  [[nodiscard]] Duration late() const noexcept;

 private:
  void watch() noexcept;

  const Descriptor in_, out_;
  std::atomic<std::int64_t> sent_ns_{0}, last_ns_{0};  ///< of the byte under way, 0: none; what the last one took
  Wakeup quit_;
  std::thread thread_;  ///< last: it uses the members above
};

}  // namespace kphi::daq
