// Addresses of devices as a bench file writes them. Nothing is decoded: no %20, no default scheme.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace kphi {

/// A name, an IPv4 address, or an IPv6 address in brackets, then :PORT (1 to 65535).
struct HostPort {
  std::string host;  ///< without brackets
  std::uint16_t port = 0;

  /// "192.168.1.20:502", "[fe80::1]:502"
  [[nodiscard]] std::string text() const;
};

/// "scheme:location?key=value&key=value".
class Uri {
 public:
  /// `device` ("supply") and `forms` ("write modbus-tcp:HOST or …") are for messages only. Throws
  /// std::invalid_argument: no scheme, a blank or unprintable character, an option without '=' or given twice.
  Uri(std::string text, std::string device, std::string forms);

  [[nodiscard]] const std::string& scheme() const noexcept { return scheme_; }
  [[nodiscard]] const std::string& location() const noexcept { return location_; }
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& options() const noexcept { return options_; }
  /// The location as host and port. Throws as refuse() does.
  [[nodiscard]] HostPort host_and_port(std::uint16_t usual_port) const;
  /// Throws std::invalid_argument: "supply "text": cause; next move", which is the forms if empty.
  [[noreturn]] void refuse(const std::string& cause, const std::string& next_move = {}) const;

 private:
  std::string text_, device_, forms_;
  std::string scheme_, location_;
  std::vector<std::pair<std::string, std::string>> options_;
};

/// A USB device: "usb:VID:PID[:SERIAL][@PORT]". VID and PID are four hexadecimal digits each, or '*' for any; PORT is
/// the socket as sysfs names it: 1-1.4, or 1-1.4:1.0 for one interface.
struct UsbAddress {
  std::optional<std::uint16_t> vendor, product;  ///< nullopt: any
  std::string serial;                            ///< empty: any
  std::string port_path;                         ///< empty: any

  /// nullopt: not of this form.
  [[nodiscard]] static std::optional<UsbAddress> read(std::string_view text);
  /// Throws std::invalid_argument with one line that shows the form.
  [[nodiscard]] static UsbAddress parse(std::string_view text);
  /// read() gives the same address again.
  [[nodiscard]] std::string text() const;
  /// Does not compare the port.
  [[nodiscard]] bool fits(std::uint16_t its_vendor, std::uint16_t its_product,
                          std::string_view its_serial) const noexcept;
  friend bool operator==(const UsbAddress&, const UsbAddress&) = default;
};

}  // namespace kphi
