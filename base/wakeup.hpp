// An event that wakes a thread out of poll(2): an eventfd.
#pragma once

#include "base/descriptor.hpp"

namespace kphi {

class Wakeup {
 public:
  /// Throws std::system_error when the system has no more descriptors.
  Wakeup();
  /// Any thread, and a signal handler.
  void raise() noexcept;
  /// False: it was not raised since the last clear().
  bool clear() noexcept;
  /// Readable while raised.
  [[nodiscard]] int descriptor() const noexcept { return event_.number(); }

 private:
  Descriptor event_;
};

}  // namespace kphi
