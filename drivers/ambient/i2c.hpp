// An I²C bus as a sensor's driver sees it. Blocking; one thread.
#pragma once

#include <cstdint>
#include <span>

namespace kphi::ambient {

class I2c {
 public:
  virtual ~I2c() = default;
  /// Writes, then a stop. Throws DeviceError: no acknowledgement, bus stuck, bridge gone.
  virtual void write(std::uint8_t address, std::span<const std::uint8_t> bytes) = 0;
  /// Writes one register number, repeats the start and reads. Throws DeviceError.
  virtual void read(std::uint8_t address, std::uint8_t register_number, std::span<std::uint8_t> into) = 0;
};

}  // namespace kphi::ambient
