#include "drivers/netbox/wakeup.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace kphi::netbox {

Wakeup::Wakeup() : descriptor_(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
  if (descriptor_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
}

Wakeup::~Wakeup() { close(descriptor_); }

void Wakeup::raise() noexcept { eventfd_write(descriptor_, 1); }

void Wakeup::clear() noexcept {
  eventfd_t ignored;
  eventfd_read(descriptor_, &ignored);
}

}  // namespace kphi::netbox
