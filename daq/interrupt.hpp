// Ctrl-C, SIGTERM and SIGHUP as a question that the runner asks on every tick.
#pragma once

#include <stdexcept>

namespace kphi::daq {

/// Thrown by the runner when a person or the system asked it to stop. Exit code 130.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// While it lives the signals SIGINT, SIGTERM and SIGHUP only count; afterwards they do what they did before.
class SignalWatch {
 public:
  SignalWatch();
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  /// How many arrived. Any thread.
  [[nodiscard]] static int count() noexcept;
};

}  // namespace kphi::daq
