// The only way to turn the motor.
#pragma once

#include "daq/bench.hpp"

namespace kphi::daq {

/// While a Spin lives the motor may turn; when it goes, by whatever way, the motor coasts.
class Spin {
 public:
  /// `direction` +1 counter-clockwise, -1 clockwise.
  Spin(MotorLink& motor, int direction) noexcept : motor_(motor), direction_(direction) {}
  ~Spin() { motor_.coast(); }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

  /// Unsigned speed.
  void at(RadPerSec speed) { motor_.spin_at(RadPerSec(direction_ * speed.value())); }
  /// Tells the driver's watchdog that someone still watches.
  void renew() noexcept { motor_.renew(); }

 private:
  MotorLink& motor_;
  int direction_;
};

}  // namespace kphi::daq
