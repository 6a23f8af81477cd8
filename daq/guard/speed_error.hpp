// Whether the rotor follows its command. A command opens a band, from the speed of the slowest accelerating rotor to
// the commanded speed. A speed outside the band for longer than closed loop and host need, or the current of a stalled
// motor at no speed, means a rotor that is blocked, out of step, turning the wrong way or running away.
//
// The bound, with speed read at f Hz: 1/f until the first reading that shows it, then the patience of 40 ms (two time
// constants of the closed loop, 0.02 s each) and of the host, and 1/f again. 50 Hz on a live bench: 140 ms. Current is
// read every 160 ms then, and the loop takes 0.1 s to wind up at 100 RPM: 0.45 s, in which 30 A heat a coil by 3 °C.
#pragma once

#include <cstdint>
#include <string>

#include "base/clock.hpp"
#include "base/device_data.hpp"
#include "compensation/units.hpp"

namespace kphi::daq {

struct SpeedError {
  enum class Kind : std::uint64_t {
    none,
    strays,   ///< the speed has left its band
    stalled,  ///< a current beyond what still air may cool, at less than 100 rad/s
    unseen,   ///< other readings arrive, but no speed
  };
  Kind kind = Kind::none;
  RadPerSec commanded, measured;  ///< positive in the commanded direction
  Amperes motor_current;          ///< estimated by the module
  Duration lasts{0};              ///< bench time
};

/// What happened, and the next move; empty without an error.
[[nodiscard]] std::string to_words(const SpeedError& error);

/// One thread. Instants are bench time.
class SpeedWatch {
 public:
  /// In addition to 15 % of the command, for cogging and the noise of the estimate at low speed; rad/s.
  static constexpr double kFloor = 20;
  /// Smaller errors are safe; the step is flagged after the run.
  static constexpr double kShare = 0.15;
  /// rad/s². A 6-inch three-blade with 12 V and 30 A still does 1500 near its top; smaller ones ten times that.
  static constexpr double kSlowestRise = 1000;
  /// rad/s². Coasting, when a supply that cannot sink forbids braking: friction and drag of 5 inches at 100 rad/s.
  static constexpr double kSlowestFall = 50;
  static constexpr Duration kPatience = std::chrono::milliseconds(40);
  /// A. 65 mN m, which the 2306 sustains in still air; 100 ms of it bring any rotor under 6e-5 kg m² ...
  static constexpr double kStallCurrent = 15;
  /// ... beyond this, rad/s.
  static constexpr double kTurning = 100;
  static constexpr Duration kStallPatience = std::chrono::milliseconds(100);
  static constexpr Duration kBlind = std::chrono::milliseconds(300);

  /// `direction` +1 counter-clockwise, -1 clockwise. `host`: how late a command may leave and a reading arrive. `share`
  /// of the command by which the speed may be off, in addition to kFloor.
  SpeedWatch(int direction, Duration host, double share = kShare) noexcept
      : direction_(direction), host_(host), share_(share) {}

  /// Unsigned, from now on. The first command expects a motor at rest.
  void command(Instant at, RadPerSec speed) noexcept;
  /// The command ramps to `speed`: until the next one the rotor may be anywhere between.
  void command_ramp(Instant at, RadPerSec speed) noexcept;
  /// The speed is no longer commanded. Clears the error.
  void release() noexcept { *this = SpeedWatch(direction_, host_, share_); }
  void take(const MotorReading& reading) noexcept;
  /// % of the command by which the newest speed leaves its band, beside kFloor; NaN while no speed is commanded.
  [[nodiscard]] double error_percent() const noexcept;
  /// The first error since the last release.
  [[nodiscard]] const SpeedError& error() const noexcept { return error_; }

 private:
  void advance(Instant at) noexcept;
  void judge_speed(Instant at) noexcept;
  void judge_current(Instant at) noexcept;
  void found(SpeedError::Kind kind, Duration lasts) noexcept;

  int direction_;
  Duration host_;
  double share_;
  bool watching_ = false;
  bool ramping_ = false;
  double commanded_ = 0, speed_ = 0, current_ = 0;
  double low_ = 0, high_ = 0;  ///< the band, rad/s
  Instant now_{0}, seen_at_{0};
  Instant stray_since_ = kNever, stalled_since_ = kNever;
  SpeedError error_;
};

}  // namespace kphi::daq
