// Throttle commands of the simulated module, and the arming that gates them: raw_value and the packed command of the
// flight controller interface. ctrl_velocity, ctrl_volts and ctrl_pwm do not pass here and need no arming.
#pragma once

#include <cstdint>
#include <optional>

#include "drivers/sim/iq_control.hpp"
#include "drivers/sim/iq_entries.hpp"

namespace kphi::sim {

class IqThrottle {
 public:
  enum class Event : std::uint8_t { none, armed, disarmed };
  /// One throttle command, 0..1.
  Event command(double throttle, const IqMemory& memory) noexcept;
  /// A write of motor_armed.
  Event arm(bool armed) noexcept;
  void power_up(const IqMemory& memory) noexcept;
  [[nodiscard]] bool armed() const noexcept { return armed_; }
  /// What this throttle asks of the motor; nothing: coast.
  [[nodiscard]] static std::optional<MotorDrive> asked(double throttle, const IqMemory& memory) noexcept;

 private:
  bool armed_ = false;
  std::uint32_t arming_ = 0, disarming_ = 0;  ///< such throttles in a row
};

}  // namespace kphi::sim
