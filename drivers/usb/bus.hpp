// The USB of this host through libusb: the devices as listed, and an opened one, which may also be one of a test. Its
// calls block until done or timed out, and belong to one thread at a time.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/uri.hpp"

struct libusb_context;

namespace kphi::usb {

/// How a transfer ended.
enum class Outcome : std::uint8_t {
  done,
  timed_out,
  stalled,  ///< the endpoint halts until clear_halt()
  gone,     ///< unplugged
  failed,   ///< anything else the bus reports
};

[[nodiscard]] const char* name_of(Outcome outcome) noexcept;

struct Transfer {
  Outcome outcome = Outcome::done;
  std::size_t bytes = 0;  ///< transferred, also when it ended early
};

enum class EndpointKind : std::uint8_t { bulk, interrupt, other };

struct Endpoint {
  std::uint8_t address = 0;  ///< bit 7: IN
  EndpointKind kind = EndpointKind::other;
  std::uint16_t packet_bytes = 0;  ///< largest packet
  [[nodiscard]] bool in() const noexcept { return (address & 0x80) != 0; }
};

struct Interface {
  std::uint8_t number = 0;
  std::uint8_t class_code = 0, subclass = 0, protocol = 0;
  std::vector<Endpoint> endpoints;
};

/// The eight bytes of a control request (USB 2.0, 9.3) that brings data; the length is that of the data.
struct Setup {
  std::uint8_t request_type = 0;  ///< bmRequestType
  std::uint8_t request = 0;       ///< bRequest
  std::uint16_t value = 0;        ///< wValue
  std::uint16_t index = 0;        ///< wIndex
};

/// One device as it is on the bus.
struct Listing {
  std::uint16_t vendor = 0, product = 0;
  std::string serial;       ///< empty: it has none, or this user has no access to it
  std::string port_path;    ///< "1-1.4"
  bool readable = true;     ///< false: this user may not open it
  bool instrument = false;  ///< has an interface of the Test and Measurement Class
  friend bool operator==(const Listing&, const Listing&) = default;
};

[[nodiscard]] bool fits(const UsbAddress& wanted, const Listing& found) noexcept;
/// "04d8:00dd, serial 0001AB, port 1-1.4".
[[nodiscard]] std::string to_string(const Listing& listing);

class Transport {
 public:
  using Timeout = std::chrono::milliseconds;

  Transport() = default;
  virtual ~Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;

  /// For messages: "USB device 04d8:00dd, serial 0001, port 1-2".
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
  /// "/dev/bus/usb/001/004"; empty: unknown.
  [[nodiscard]] virtual std::string device_file() const { return {}; }
  [[nodiscard]] virtual std::uint16_t vendor() const noexcept = 0;
  [[nodiscard]] virtual std::uint16_t product() const noexcept = 0;
  [[nodiscard]] virtual const std::vector<Interface>& interfaces() const noexcept = 0;
  /// Claims the interface exclusively, from the kernel's driver too, until the transport is destroyed. Throws
  /// DeviceError.
  virtual void claim(std::uint8_t interface_number) = 0;

  virtual Transfer control_in(const Setup& setup, std::span<std::uint8_t> data, Timeout timeout) noexcept = 0;
  /// Bulk or interrupt, as the endpoint is.
  virtual Transfer read(const Endpoint& endpoint, std::span<std::uint8_t> data, Timeout timeout) noexcept = 0;
  virtual Transfer write(const Endpoint& endpoint, std::span<const std::uint8_t> data, Timeout timeout) noexcept = 0;
  virtual Outcome clear_halt(const Endpoint& endpoint) noexcept = 0;
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
  libusb_context* context_ = nullptr;
};

}  // namespace kphi::usb
