#include "drivers/netbox/receive/doorbell.hpp"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>

namespace kphi::netbox {

using namespace std::chrono_literals;

static_assert(sizeof(std::atomic<std::uint32_t>) == 4 && std::atomic<std::uint32_t>::is_always_lock_free);

void Doorbell::sleep(std::chrono::nanoseconds wall) noexcept {
  const auto clamped = std::clamp<std::chrono::nanoseconds>(wall, 0ns, 1h);
  const timespec timeout{clamped.count() / 1'000'000'000, clamped.count() % 1'000'000'000};
  syscall(SYS_futex, &listening_, FUTEX_WAIT_PRIVATE, 1, &timeout, nullptr, 0);
  leave();
}

void Doorbell::wake() noexcept { syscall(SYS_futex, &listening_, FUTEX_WAKE_PRIVATE, 1, nullptr, nullptr, 0); }

}  // namespace kphi::netbox
