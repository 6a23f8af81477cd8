// The USB of this host through libusb: its devices, and one opened device. One thread handles libusb's events; all
// others wait for it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/usb/transport.hpp"

struct libusb_device_handle;
struct libusb_transfer;
struct libusb_context;

namespace kphi::usb {

class Device final : public Transport {
 public:
  /// Takes over an open handle, reads the descriptors.
  Device(libusb_device_handle* handle, const Listing& listing);
  /// Releases the interfaces, to the kernel's driver too.
  ~Device() override;

  const std::string& name() const noexcept override { return name_; }
  std::uint16_t vendor() const noexcept override { return listing_.vendor; }
  std::uint16_t product() const noexcept override { return listing_.product; }
  const std::vector<Interface>& interfaces() const noexcept override { return interfaces_; }
  void claim(std::uint8_t interface_number) override;
  Transfer control_in(const Setup& setup, std::span<std::uint8_t> data, Timeout timeout) noexcept override;
  Transfer control_out(const Setup& setup, std::span<const std::uint8_t> data, Timeout timeout) noexcept override;
  Transfer read(const Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept override;
  Transfer write(const Endpoint& endpoint, std::span<const std::uint8_t> data, Timeout timeout) noexcept override;
  Outcome clear_halt(const Endpoint& endpoint) noexcept override;
  void cancel() noexcept override;

 private:
  static void on_end(libusb_transfer* transfer) noexcept;
  Transfer control(Setup setup, std::span<std::uint8_t> data, bool in, Timeout timeout) noexcept;
  Transfer move(const Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept;
  Transfer carry_out(libusb_transfer* transfer) noexcept;

  libusb_device_handle* handle_;
  const Listing listing_;
  const std::string name_;
  std::vector<Interface> interfaces_;
  std::vector<std::uint8_t> claimed_;

  std::mutex mutex_;
  std::condition_variable ended_;
  libusb_transfer* under_way_ = nullptr;
  bool cancelled_ = false;
};

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
