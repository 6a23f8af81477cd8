// A serial port, opened exclusively: raw, 8N1, no flow control, never blocking.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/descriptor.hpp"
#include "base/error.hpp"

namespace kphi::serial {

/// Its code in termios, B115200 for 115200; 0: unknown.
[[nodiscard]] unsigned speed_code(unsigned baud) noexcept;

/// Names under /dev/serial/by-id: they do not depend on the socket.
[[nodiscard]] std::vector<std::string> stable_names();

/// The port was open and has disappeared: unplugged. It must be opened again.
class PortGone : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

class Port {
 public:
  /// `specification`: a path, or a USB adapter as discovery.hpp names it. Throws DeviceError: unknown baud, no such
  /// device, no permission, not a terminal, or in use. TIOCEXCL refuses a second program; flock(2) also refuses root,
  /// if that program uses flock.
  Port(const std::string& specification, unsigned baud);
  ~Port();
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;

  /// For poll(2).
  [[nodiscard]] int fd() const noexcept { return port_.number(); }
  /// The path that was opened.
  [[nodiscard]] const std::string& device() const noexcept { return device_; }
  [[nodiscard]] unsigned baud() const noexcept { return baud_; }

  /// Reads the available bytes; 0: there are none. Throws PortGone.
  std::size_t read(std::span<std::uint8_t> into);
  /// Writes as much as there is room for. Throws PortGone.
  std::size_t write(std::span<const std::uint8_t> bytes);
  /// Waits until there are bytes or the port is gone; false after `wall`.
  [[nodiscard]] bool wait(Duration wall) const noexcept;
  /// Bytes handed over that have not left yet; 0 if unknown.
  [[nodiscard]] std::size_t unsent() const noexcept;
  /// Waits until all bytes have left, at most `wall`.
  void drain(Duration wall) const noexcept;
  /// Throws DeviceError. Bytes on their way in either direction are lost.
  void set_baud(unsigned baud);

 private:
  [[noreturn]] void gone(const char* operation, int error) const;
  void apply(unsigned baud);

  std::string device_;
  unsigned baud_ = 0;
  Descriptor port_;
};

}  // namespace kphi::serial
