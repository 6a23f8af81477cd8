#include "test/drivers/sim_equipment/supply_server.hpp"

#include <poll.h>
#include <sys/eventfd.h>

namespace kphi::sim {
namespace {

constexpr Duration kTick = std::chrono::milliseconds(1);  // of the physics, and longest nap

}  // namespace

SupplyServer::SupplyServer(const SupplyServerSettings& settings)
    : settings_(settings),
      stop_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      port_({settings.device, settings.host, settings.port}),
      slave_(settings.supply) {}

void SupplyServer::request_stop() noexcept {
  const std::uint64_t one = 1;
  [[maybe_unused]] const auto written = ::write(stop_.number(), &one, sizeof one);
}

void SupplyServer::inspect(const std::function<void(SupplySlave&, SupplyLoad&, Instant)>& look) {
  const std::lock_guard lock(mutex_);
  look(slave_, settings_.load, clock_.now());
}

void SupplyServer::run() {
  while (true) {
    pollfd stop{stop_.number(), POLLIN, 0};
    if (::poll(&stop, 1, patience()) > 0) return;
    const std::lock_guard lock(mutex_);
    step();
  }
}

/// In ms: at least one tick of the physics per ms; 0 when a reply is due.
int SupplyServer::patience() {
  const std::lock_guard lock(mutex_);
  return slave_.next_due() <= clock_.now() + kTick / 2 ? 0 : 1;
}

void SupplyServer::step() {
  const Instant now = clock_.now();
  slave_.advance(settings_.load, now);
  port_.receive(slave_, now);
  port_.send(slave_, clock_.now());
}

}  // namespace kphi::sim
