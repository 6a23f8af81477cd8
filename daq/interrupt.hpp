// Ctrl-C, Ctrl-\\, SIGTERM and SIGHUP as a question that the runner asks on every tick.
#pragma once

#include "daq/run_stopped.hpp"

namespace kphi::daq {

/// Thrown by the runner when a person or the system asked it to stop. Exit code 130.
class Interrupted : public RunStopped {
 public:
  using RunStopped::RunStopped;
  explicit Interrupted(const std::string& cause) : RunStopped({cause, {}, {}, {}, {}}) {}
};

/// While it lives the signals SIGINT, SIGTERM, SIGHUP and SIGQUIT only count; afterwards they do what they did before.
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
