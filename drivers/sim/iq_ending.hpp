// How the module ends a motion by itself, after a communication timeout or a disarming: at once or through 0 V, then
// its song, then coast or brake.
#pragma once

#include <cstdint>

#include "drivers/clock.hpp"
#include "drivers/sim/iq_control.hpp"

namespace kphi::sim {

class IqEnding {
 public:
  struct Plan {
    int behavior = 0;          ///< 0 coast, 1 0 V then coast, 2 0 V then brake
    int song = 0;              ///< 0 never, 1 once, 2 continuously: the end is never reached
    double stopped_speed = 5;  ///< rad/s
    double stopped_time = 1;   ///< s
  };
  void begin(const Plan& plan, Instant now) noexcept;
  void cancel() noexcept { phase_ = Phase::none; }
  /// What to drive while it lasts, and at its end.
  void step(double speed, Instant now, MotorDrive& drive) noexcept;
  [[nodiscard]] bool going_on() const noexcept { return phase_ != Phase::none; }
  [[nodiscard]] bool singing() const noexcept { return phase_ == Phase::singing && plan_.song != 0; }
  /// Only a command to spin or an arming ends it.
  [[nodiscard]] bool endless() const noexcept { return singing() && plan_.song == 2; }

 private:
  enum class Phase : std::uint8_t { none, slowing, singing };
  void slow_down(double speed, Instant now) noexcept;

  Plan plan_;
  Phase phase_ = Phase::none;
  Instant since_{0};
  Instant slow_since_ = kNever;
};

}  // namespace kphi::sim
