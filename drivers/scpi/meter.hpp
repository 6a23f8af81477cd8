// What a measuring instrument sees at the motor's supply, whatever it is and whatever wire it hangs on.
#pragma once

#include <optional>
#include <string>

#include "drivers/clock.hpp"

namespace kphi::scpi {

struct MeterReading {
  Instant at{0};            ///< bench time: midpoint of the first request and the last answer
  Duration uncertainty{0};  ///< half of the time between the two: each true moment is at ± uncertainty
  std::optional<double> voltage_v, current_a, power_w;  ///< what was asked for
};

/// Calls block for as long as the wire needs and belong to one thread at a time.
class Meter {
 public:
  virtual ~Meter() = default;
  /// Throws DeviceError.
  [[nodiscard]] virtual MeterReading read() = 0;
  /// "meter 34401A on USB device 0957:0607, serial MY01, port 1-2".
  [[nodiscard]] virtual const std::string& identity() const noexcept = 0;
};

}  // namespace kphi::scpi
