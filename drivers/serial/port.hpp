// A serial port, opened exclusively: raw, 8N1, no flow control, never blocking. And how it is found: the path of a
// serial adapter's terminal from its USB identity, by sysfs alone.
//
// A bench file names the adapter in one of two ways:
//   /dev/serial/by-id/…               a path that begins with '/': taken as it is
//   usb:VID:PID[:SERIAL][@PORT]       VID and PID are four hexadecimal digits each, or '*' for any. SERIAL is the
//                                     adapter's own serial number. PORT is the socket it is plugged into, as sysfs
//                                     names it: 1-1.2, or 1-1.2:1.0 for one interface of an adapter with several ports.
// usb:0403:6001:A10K0000 finds that FTDI adapter wherever it is plugged in; usb:*:*:A10K0000 does so by its serial
// number alone; usb:1a86:7523@1-1.2 tells two adapters without serial numbers (CH340) apart by their sockets.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/clock.hpp"
#include "base/descriptor.hpp"
#include "base/error.hpp"
#include "base/finding.hpp"
#include "base/uri.hpp"

namespace kphi::serial {

/// Whether this terminal sends at `baud`.
[[nodiscard]] bool runs_at(int descriptor, unsigned baud) noexcept;

/// Names under /dev/serial/by-id: they do not depend on the socket.
[[nodiscard]] std::vector<std::string> stable_names();

/// The port was open and has disappeared: unplugged. It must be opened again.
class PortGone : public DeviceError {
 public:
  using DeviceError::DeviceError;
};

class Port {
 public:
  /// `specification`: a path, or a USB adapter as above. Throws DeviceError: unknown baud, no such device, no
  /// permission, not a terminal, or in use. TIOCEXCL refuses a second program; flock(2) also refuses root, if that
  /// program uses flock.
  Port(const std::string& specification, unsigned baud);
  ~Port();

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

/// Where sysfs and devtmpfs are mounted; tests use their own.
struct Roots {
  std::filesystem::path sys = "/sys";
  std::filesystem::path dev = "/dev";
};

/// A serial port behind USB.
struct Adapter {
  std::filesystem::path device;  ///< /dev/ttyUSB0
  std::uint16_t vendor = 0, product = 0;
  std::string serial;                   ///< empty: the adapter has none (CH340)
  std::string words;                    ///< maker and product, from the adapter
  std::string port;                     ///< "1-1.2": bus and sockets on the way
  std::string interface;                ///< "1-1.2:1.0"
  std::optional<int> latency_timer_ms;  ///< only FTDI's driver has one

  /// Its address in a bench file: with its serial number, or with its socket if it has none.
  [[nodiscard]] std::string specification() const;
  [[nodiscard]] const std::string& socket() const noexcept { return interface.empty() ? port : interface; }
  [[nodiscard]] bool fits(const UsbAddress& wanted) const;
  /// "/dev/ttyUSB0 is usb:0403:6001:A10K0000 (FTDI FT232R USB UART) in socket 1-1.2"
  [[nodiscard]] std::string line() const;
};

/// All that are plugged in, by name of their terminal.
[[nodiscard]] std::vector<Adapter> adapters(const Roots& roots = {});

/// The adapter whose terminal `device` is or links to; nullopt for a pseudo-terminal or a port of the mainboard.
[[nodiscard]] std::optional<Adapter> adapter_of(const std::filesystem::path& device, const Roots& roots = {});

/// The present path of `specification`; may change when an adapter is plugged in again. Throws DeviceError, which lists
/// the candidates, when the specification is malformed, or fits no adapter or more than one.
[[nodiscard]] std::string path_of(const std::string& specification, const Roots& roots = {});

/// The timer's effect on queries, and the remedy; nullopt when it is 4 ms or less, or absent.
[[nodiscard]] std::optional<Finding> judge_latency_timer(const Adapter& adapter);

}  // namespace kphi::serial
