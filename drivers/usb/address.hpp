// Which device is meant: "usb:04d8:00dd", with a serial number "usb:04d8:00dd:0001AB", or at a socket
// "usb:1a86:7523@1-1.4" (bus-port.port…, as in /sys/bus/usb/devices).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace kphi::usb {

struct Address {
  std::uint16_t vendor = 0, product = 0;
  std::string serial;     ///< empty: any
  std::string port_path;  ///< empty: any

  /// Throws std::invalid_argument with one sentence that shows the form.
  [[nodiscard]] static Address parse(std::string_view text);
  [[nodiscard]] std::string text() const;
  friend bool operator==(const Address&, const Address&) = default;
};

/// One device as it is on the bus.
struct Listing {
  std::uint16_t vendor = 0, product = 0;
  std::string serial;       ///< empty: it has none, or this user may not ask
  std::string port_path;    ///< "1-1.4"
  bool readable = true;     ///< false: this user may not open it
  bool instrument = false;  ///< has an interface of the Test and Measurement Class
  friend bool operator==(const Listing&, const Listing&) = default;
};

[[nodiscard]] bool fits(const Address& wanted, const Listing& found) noexcept;
/// "04d8:00dd, serial 0001AB, port 1-1.4".
[[nodiscard]] std::string to_string(const Listing& listing);

}  // namespace kphi::usb
