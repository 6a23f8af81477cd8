// The only way to turn the motor.
#pragma once

#include <optional>

#include "daq/bench.hpp"
#include "daq/guard.hpp"

namespace kphi::daq {

/// While a Spin lives the motor may turn; when it goes before a stop of its own has come to a good end, by whatever
/// way, the motor is let go at once. After a trip it turns no more.
class Spin {
 public:
  /// `direction` +1 counter-clockwise, -1 clockwise.
  Spin(MotorLink& motor, int direction, Guard& guard) noexcept : motor_(motor), direction_(direction), guard_(guard) {}
  ~Spin() {
    if (!let_go_) motor_.emergency_stop();
  }
  Spin(const Spin&) = delete;
  Spin& operator=(const Spin&) = delete;

  /// Unsigned speed. Throws SafetyStop when the guard does not allow it now. A trip that comes while this speaks is
  /// seen afterwards: either its own order to coast is the last word, or that of the destructor.
  void at(RadPerSec speed) {
    guard_.check(true);
    let_go_ = stopping_ = false;
    motor_.spin_at(RadPerSec(direction_ * speed.value()));
    guard_.latch().check();
  }
  /// Tells the driver's watchdog that someone still watches.
  void renew() noexcept { motor_.renew(); }
  /// Coasts, after a ramp if the settings want one; returns at once.
  void begin_stop(const iq::StopSettings& settings = {}) {
    motor_.begin_stop(settings);
    stopping_ = true;
  }
  /// How the stop ended; nothing while it is under way.
  [[nodiscard]] std::optional<iq::StopReport> stopped() {
    auto report = stopping_ ? motor_.stop_report() : std::nullopt;
    let_go_ = report && report->safe();
    return report;
  }

 private:
  MotorLink& motor_;
  int direction_;
  Guard& guard_;
  bool stopping_ = false;
  bool let_go_ = false;  ///< the module has confirmed that it coasts
};

}  // namespace kphi::daq
