// A serial port of our own: exclusive, raw, 8N1, no flow control.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/serial_port.hpp>
#include <string>
#include <vector>

namespace kphi::serial {

/// Whether Linux knows this rate; others are refused before the port is touched.
[[nodiscard]] bool known_baud(unsigned baud) noexcept;

/// Names under /dev/serial/by-id: they stay the same whichever socket the adapter is plugged into.
[[nodiscard]] std::vector<std::string> stable_names();

class Port {
 public:
  /// `specification`: a path, or a USB adapter as discovery.hpp names it. Throws DeviceError: unknown baud, no such
  /// device, no permission, not a terminal, or in use. A second program is refused by TIOCEXCL, root too by flock(2)
  /// when it asks the same way.
  Port(boost::asio::io_context& io, const std::string& specification, unsigned baud);
  ~Port();
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  [[nodiscard]] boost::asio::serial_port& stream() noexcept { return stream_; }
  [[nodiscard]] int native_handle() noexcept { return stream_.native_handle(); }
  /// The path that was opened.
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  /// The driver agreed to hand bytes over at once. False on most USB adapters' drivers and on pseudo-terminals.
  [[nodiscard]] bool low_latency() const noexcept { return low_latency_; }

 private:
  std::string device_;
  boost::asio::serial_port stream_;
  bool low_latency_ = false;
};

}  // namespace kphi::serial
