// Which serial port an adapter has got: from its USB identity to the path of its terminal, by sysfs alone.
//
// A bench file names the adapter in one of two ways:
//   /dev/serial/by-id/…               a path that begins with '/': taken as it is
//   usb:VID:PID[:SERIAL][@PORT]       VID and PID are four hexadecimal digits each, or '*' for any. SERIAL is the
//                                     adapter's own serial number. PORT is the socket it is plugged into, as sysfs
//                                     names it: 1-1.2, or 1-1.2:1.0 for one interface of an adapter with several ports.
// usb:0403:6001:A10K0000 finds that FTDI adapter wherever it is plugged in; usb:*:*:A10K0000 does so by its serial
// number alone; usb:1a86:7523@1-1.2 tells two adapters without serial numbers (CH340) apart by their sockets.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "drivers/finding.hpp"

namespace kphi::serial {

/// Where the system's view of its devices is mounted; tests put their own here.
struct Roots {
  std::filesystem::path sys = "/sys";
  std::filesystem::path dev = "/dev";
};

/// A serial port behind USB.
struct Adapter {
  std::filesystem::path device;  ///< /dev/ttyUSB0
  std::filesystem::path by_id;   ///< the name that stays the same in every socket; empty: udev gave none
  std::uint16_t vendor = 0, product = 0;
  std::string serial;                   ///< empty: the adapter has none (CH340)
  std::string words;                    ///< maker and product, as the adapter tells them
  std::string port;                     ///< "1-1.2": bus and sockets on the way
  std::string interface;                ///< "1-1.2:1.0"
  std::optional<int> latency_timer_ms;  ///< only FTDI's driver has one

  /// What a bench file may call it: by its serial number, or by its socket where there is none.
  [[nodiscard]] std::string specification() const;
  /// "/dev/ttyUSB0 is usb:0403:6001:A10K0000 (FTDI FT232R USB UART) in socket 1-1.2"
  [[nodiscard]] std::string line() const;
};

/// A usb: specification, taken apart. Empty and nothing: any.
struct Wanted {
  std::optional<std::uint16_t> vendor, product;
  std::string serial;
  std::string port;

  /// Nothing when `specification` is not of the form above.
  [[nodiscard]] static std::optional<Wanted> parse(const std::string& specification);
  [[nodiscard]] bool fits(const Adapter& adapter) const;
};

/// All that are plugged in, by name of their terminal.
[[nodiscard]] std::vector<Adapter> adapters(const Roots& roots = {});

/// The adapter whose terminal `device` is or links to; nothing for a pseudo-terminal or a port of the mainboard.
[[nodiscard]] std::optional<Adapter> adapter_of(const std::filesystem::path& device, const Roots& roots = {});

/// The path that `specification` means now; asked anew after an adapter was unplugged. Throws DeviceError, which lists
/// the candidates, when the specification is malformed, or fits no adapter or more than one.
[[nodiscard]] std::string path_of(const std::string& specification, const Roots& roots = {});

/// The timer's effect on a get and its reply, and the remedy; nothing when it is 4 ms or less, or there is none.
[[nodiscard]] std::optional<Finding> judge_latency_timer(const Adapter& adapter);

}  // namespace kphi::serial
