// Keeps this computer awake while the motor may turn, by a lock of logind, which is a file descriptor.
#pragma once

#include <string>

#include "base/descriptor.hpp"

namespace kphi::daq {

/// Asks logind on the system bus for a lock against sleep; the destructor releases it, and so does the death of the
/// program. Take one for each run: it costs a few ms, and at most 1.5 s if bus or logind do not answer. Any thread.
class SleepInhibitor {
 public:
  SleepInhibitor() noexcept;

  /// One line for the operator with consequence, cause and next move; empty if it is held.
  [[nodiscard]] const std::string& why_not() const noexcept { return why_not_; }

 private:
  Descriptor lock_;
  std::string why_not_;
};

}  // namespace kphi::daq
