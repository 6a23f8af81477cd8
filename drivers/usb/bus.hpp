// The USB of this host through libusb: one thread handles its events, all others wait for it.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/usb/transport.hpp"

struct libusb_context;

namespace kphi::usb {

/// Outlives the devices opened on it. Any thread.
class Bus {
 public:
  /// Throws DeviceError when libusb cannot start. A host without any USB has an empty bus.
  Bus();
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  [[nodiscard]] std::vector<Listing> list() const;
  /// Throws DeviceError: no device fits; several fit (naming them); this user may not open it (naming the udev rule).
  [[nodiscard]] std::unique_ptr<Transport> open(const UsbAddress& address) const;

 private:
  void handle_events() noexcept;

  libusb_context* context_ = nullptr;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace kphi::usb
