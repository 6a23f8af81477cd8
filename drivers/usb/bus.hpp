// The USB of this host through libusb: one thread handles its events, all else waits for it.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/usb/address.hpp"
#include "drivers/usb/transport.hpp"

struct libusb_context;
struct libusb_device;

namespace kphi::usb {

/// Outlives the devices opened on it. Any thread.
class Bus {
 public:
  /// On the bus's own thread, which must not open devices or wait for transfers.
  using PlugListener = std::function<void(const Listing& device, bool arrived)>;

  /// Throws DeviceError when libusb cannot start. A host without any USB has an empty bus.
  explicit Bus(PlugListener listener = {});
  ~Bus();
  Bus(const Bus&) = delete;
  Bus& operator=(const Bus&) = delete;

  [[nodiscard]] std::vector<Listing> list() const;
  /// Throws DeviceError: none fits; several do (naming them); this user may not open it (naming the udev rule).
  [[nodiscard]] std::unique_ptr<Transport> open(const Address& address) const;

 private:
  static int on_plug(libusb_context*, libusb_device* device, int event, void* bus) noexcept;
  void handle_events() noexcept;

  libusb_context* context_ = nullptr;
  const PlugListener listener_;
  int plug_handle_ = 0;
  bool plug_registered_ = false;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace kphi::usb
