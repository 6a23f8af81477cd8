// An event that wakes a thread out of poll(2): an eventfd.
#pragma once

#include <sys/eventfd.h>

#include <cerrno>
#include <system_error>

#include "base/descriptor.hpp"

namespace kphi {

class Wakeup {
 public:
  /// Throws std::system_error when the system has no more descriptors.
  Wakeup() : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (event_.number() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  /// Any thread, and a signal handler.
  void raise() noexcept { eventfd_write(event_.number(), 1); }
  /// False: it was not raised since the last clear().
  bool clear() noexcept {
    eventfd_t raised = 0;
    return eventfd_read(event_.number(), &raised) == 0;
  }
  /// Readable while raised.
  [[nodiscard]] int descriptor() const noexcept { return event_.number(); }

 private:
  Descriptor event_;
};

}  // namespace kphi
