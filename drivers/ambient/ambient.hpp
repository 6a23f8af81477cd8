// A source of the state of the air.
#pragma once

#include <string>

#include "drivers/ambient/air.hpp"

namespace kphi::ambient {

class Ambient {
 public:
  virtual ~Ambient() = default;
  /// One measurement. Blocks for some 110 ms, at most about two seconds; throws DeviceError.
  [[nodiscard]] virtual Air read() = 0;
  /// "BME280 at 0x76 behind USB device 04d8:00dd, serial 0001".
  [[nodiscard]] virtual const std::string& identity() const noexcept = 0;
};

}  // namespace kphi::ambient
