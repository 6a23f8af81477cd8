// A socket of the virtual USB whose device is pulled out and plugged in again as a script says.
#pragma once

#include <condition_variable>
#include <mutex>
#include <thread>

#include "drivers/sim/usb/function.hpp"
#include "test/drivers/sim_equipment/virtual_usb.hpp"

namespace kphi::sim {

/// Plugs the device in while it lives, but for the windows of `unplug`. Has a thread of its own.
class UsbSocket {
 public:
  /// All must outlive this.
  UsbSocket(VirtualUsb& bus, int port, UsbFunction& device, const UsbFaults& faults);
  ~UsbSocket();
  UsbSocket(const UsbSocket&) = delete;
  UsbSocket& operator=(const UsbSocket&) = delete;

 private:
  void run() noexcept;
  /// False: it is time to go.
  [[nodiscard]] bool wait_until(Instant due);

  VirtualUsb& bus_;
  const int port_;
  UsbFunction& device_;
  const UsbFaults& faults_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool stop_asked_ = false;
  std::thread thread_;
};

}  // namespace kphi::sim
