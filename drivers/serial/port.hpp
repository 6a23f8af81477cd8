// A serial port of our own: exclusive, raw, 8N1, no flow control, never blocking.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "drivers/clock.hpp"
#include "drivers/device_error.hpp"

namespace kphi::serial {

/// Whether Linux knows this rate; others are refused before the port is touched.
[[nodiscard]] bool known_baud(unsigned baud) noexcept;

/// Names under /dev/serial/by-id: they stay the same whichever socket the adapter is plugged into.
[[nodiscard]] std::vector<std::string> stable_names();

/// The port was there and is no more: unplugged. Only a new Port can help.
class PortGone : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

class Port {
 public:
  /// `specification`: a path, or a USB adapter as discovery.hpp names it. Throws DeviceError: unknown baud, no such
  /// device, no permission, not a terminal, or in use. A second program is refused by TIOCEXCL, root too by flock(2)
  /// when it asks the same way.
  Port(const std::string& specification, unsigned baud);
  ~Port();
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  /// For poll(2).
  [[nodiscard]] int fd() const noexcept { return fd_; }
  /// The path that was opened.
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  [[nodiscard]] unsigned baud() const noexcept { return baud_; }
  /// The driver agreed to hand bytes over at once. False on most USB adapters' drivers and on pseudo-terminals.
  [[nodiscard]] bool low_latency() const noexcept { return low_latency_; }

  /// What is there, 0 if nothing is. Throws PortGone.
  std::size_t read(std::span<std::uint8_t> into);
  /// As much as there is room for. Throws PortGone.
  std::size_t write(std::span<const std::uint8_t> bytes);
  /// Waits until read() has something to tell, be it that the port is gone; false after `wall`.
  [[nodiscard]] bool wait(Duration wall) const noexcept;
  /// Bytes handed over that have not left yet; 0 when nobody knows.
  [[nodiscard]] std::size_t unsent() const noexcept;
  /// Waits until all has left or `wall` is over.
  void drain(Duration wall) const noexcept;
  /// Throws DeviceError. What is on its way in either direction is lost.
  void set_baud(unsigned baud);

 private:
  [[noreturn]] void gone(const char* operation, int error) const;
  void apply(unsigned baud);

  std::string device_;
  unsigned baud_ = 0;
  int fd_ = -1;
  bool low_latency_ = false;
};

}  // namespace kphi::serial
