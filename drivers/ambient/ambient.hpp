// Where the state of the air comes from.
#pragma once

#include <string>

#include "drivers/ambient/air.hpp"

namespace kphi::ambient {

class Ambient {
 public:
  virtual ~Ambient() = default;
  /// One measurement. Blocks for some tens of milliseconds at most when all is well, for two seconds when not; throws
  /// DeviceError.
  [[nodiscard]] virtual Air read() = 0;
  /// "BME280 at 0x76 behind USB device 04d8:00dd, serial 0001".
  [[nodiscard]] virtual const std::string& identity() const noexcept = 0;
};

}  // namespace kphi::ambient
