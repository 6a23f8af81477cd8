// Ctrl-C, Ctrl-\\, SIGTERM and SIGHUP as a flag that the runner checks on every tick.
#pragma once

#include "daq/guard/run_stopped.hpp"

namespace kphi::daq {

/// Thrown by the runner when a person or the system asks it to stop.
class Interrupted : public RunStopped {
 public:
  explicit Interrupted(StopWords words) : RunStopped(std::move(words), ExitCode::interrupted) {}
  explicit Interrupted(const std::string& cause) : Interrupted(StopWords{cause, {}, {}, {}, {}}) {}
};

/// While it lives, SIGINT, SIGTERM, SIGHUP and SIGQUIT are only counted; afterwards they act as before.
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
