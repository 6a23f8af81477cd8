// The arms as they are: servos that follow their command with a lag, hubs that hang in the backlash of the gears, and
// an angle that is told late.
#pragma once

#include <array>
#include <cstddef>

#include "compensation/flight/simulated_vehicle.hpp"

namespace kphi::flight {

struct ArmHardware {
  double lag_s = 0;             ///< time constant of a servo behind its command
  double backlash = 0;          ///< rad: how far a hub moves while its servo stands still
  double feedback_delay_s = 0;  ///< age of the angle that the controller is told, at most kLongestDelay
};
inline constexpr double kLongestDelay = 0.2;  // s

/// Servos, hubs and feedback of all arms. Allocates nothing.
class Arms {
 public:
  /// At rest; from one shape to the next the command takes `morph_s` [s], above 0. `step` [s]: between two calls of
  /// tell().
  Arms(const Angles& at, double morph_s, const ArmHardware& hardware, double step) noexcept;

  /// From now on to `goal`.
  void begin(const Angles& goal) noexcept;
  /// Whether a hub may move before the next begin().
  [[nodiscard]] bool moving() const noexcept { return moving_; }
  /// To this time [s], not before that of the last call.
  void advance(double to) noexcept;
  /// Once a step: what the servos say, as old as the feedback is.
  [[nodiscard]] Angles tell() noexcept;

  [[nodiscard]] const Angles& hubs() const noexcept { return hubs_; }
  /// rad/s
  [[nodiscard]] const Rotors<double>& rates() const noexcept { return rates_; }
  [[nodiscard]] const Angles& goal() const noexcept { return goal_; }

 private:
  ArmHardware hardware_;
  ArmMotion command_;
  double now_ = 0;
  Angles goal_, servos_, hubs_;
  Rotors<double> rates_;
  bool moving_ = false;
  std::array<Angles, 128> told_{};  ///< a ring
  std::size_t late_ = 0, next_ = 0;
};

}  // namespace kphi::flight
