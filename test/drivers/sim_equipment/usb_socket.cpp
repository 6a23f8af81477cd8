#include "test/drivers/sim_equipment/usb_socket.hpp"

#include <algorithm>

namespace kphi::sim {

UsbSocket::UsbSocket(VirtualUsb& bus, int port, UsbFunction& device, const UsbFaults& faults)
    : bus_(bus), port_(port), device_(device), faults_(faults) {
  bus_.plug(port_, device_);
  thread_ = std::thread([this] { run(); });
}

UsbSocket::~UsbSocket() {
  {
    const std::lock_guard lock(mutex_);
    stop_asked_ = true;
  }
  changed_.notify_all();
  thread_.join();
  bus_.unplug(port_);
}

void UsbSocket::run() noexcept {
  FaultScript windows = faults_.script();
  std::erase_if(windows, [](const Fault& fault) { return fault.kind != FaultKind::ambient_unplug; });
  std::sort(windows.begin(), windows.end(), [](const Fault& a, const Fault& b) { return a.at < b.at; });
  for (const Fault& window : windows) {
    if (!wait_until(window.at)) return;
    bus_.unplug(port_);
    if (!wait_until(window.end())) return;
    bus_.plug(port_, device_);
  }
}

bool UsbSocket::wait_until(Instant due) {
  std::unique_lock lock(mutex_);
  const Duration wall = faults_.clock().shrunk(std::max(Duration{0}, due - faults_.now()));
  return !changed_.wait_for(lock, wall, [&] { return stop_asked_; });
}

}  // namespace kphi::sim
