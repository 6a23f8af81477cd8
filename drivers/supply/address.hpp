// The address of a Modbus supply:
//
//     modbus-rtu:/dev/ttyUSB1?baud=115200&slave=1&model=RD6006
//     modbus-tcp:192.168.1.20:502?slave=1
//
// Every option after `?` may be left out: baud is the model's usual one (115200 without a model), slave 1, port 502,
// and without a model the device is asked for its model.
#pragma once

#include <cstdint>
#include <string>

#include "base/uri.hpp"

namespace kphi::supply {

struct Address {
  enum class Wire : std::uint8_t { rtu, tcp };
  std::string uri;  ///< as written, for messages
  Wire wire = Wire::rtu;
  std::string device;  ///< rtu: absolute path
  unsigned baud = 0;   ///< rtu: one that known_baud() knows
  HostPort tcp;
  int slave = 1;      ///< 1 to 247; tcp also 255
  std::string model;  ///< of the table of models; empty: any of them

  /// "/dev/ttyUSB1" or "192.168.1.20:502".
  [[nodiscard]] std::string where() const;
};

/// Rates that libmodbus sets as asked; for any other it silently runs at 9600 baud.
[[nodiscard]] bool known_baud(unsigned baud) noexcept;

/// Strict. Throws std::invalid_argument with one line that ends in what to write instead.
[[nodiscard]] Address parse_address(const std::string& text);

}  // namespace kphi::supply
