// The only way to turn the motor.
#pragma once

#include <optional>

#include "daq/bench/bench.hpp"
#include "daq/guard/guard.hpp"

namespace kphi::daq {

/// The motor may turn while a MotorEnable lives. Its destructor coasts the motor at once, unless a stop of its own was
/// confirmed. After a trip the motor does not turn again.
class MotorEnable {
 public:
  /// `direction` +1 counter-clockwise, -1 clockwise.
  MotorEnable(MotorLink& motor, int direction, Guard& guard) noexcept
      : motor_(motor), direction_(direction), guard_(guard) {}
  ~MotorEnable() {
    if (!coasting_) motor_.emergency_stop();
  }
  MotorEnable(const MotorEnable&) = delete;
  MotorEnable& operator=(const MotorEnable&) = delete;

  /// Unsigned speed. Throws SafetyStop if the guard does not allow it now. A trip during this call is seen afterwards:
  /// the last order is then its order to coast, or the destructor's.
  void at(RadPerSec speed) {
    guard_.check(true);
    coasting_ = stopping_ = false;
    motor_.spin_at(RadPerSec(direction_ * speed.value()));
    guard_.latch().check();
  }
  /// Feeds the driver's watchdog.
  void renew() noexcept { motor_.renew(); }
  /// Coasts, after a ramp if the settings ask for one; returns at once.
  void begin_stop(const iq::StopSettings& settings = {}) {
    motor_.begin_stop(settings);
    stopping_ = true;
  }
  /// How the stop ended; nullopt while it is under way.
  [[nodiscard]] std::optional<iq::StopReport> stopped() {
    auto report = stopping_ ? motor_.stop_report() : std::nullopt;
    coasting_ = report && report->safe();
    return report;
  }

 private:
  MotorLink& motor_;
  int direction_;
  Guard& guard_;
  bool stopping_ = false;
  bool coasting_ = false;  ///< the module has confirmed that it coasts
};

}  // namespace kphi::daq
