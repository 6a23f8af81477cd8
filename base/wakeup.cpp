#include "base/wakeup.hpp"

#include <sys/eventfd.h>

#include <cerrno>
#include <system_error>

namespace kphi {

Wakeup::Wakeup() : event_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (event_.number() < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

void Wakeup::raise() noexcept { eventfd_write(event_.number(), 1); }

bool Wakeup::clear() noexcept {
  eventfd_t raised = 0;
  return eventfd_read(event_.number(), &raised) == 0;
}

}  // namespace kphi
