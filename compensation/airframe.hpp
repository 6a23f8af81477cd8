// The body of a morphing quadrotor: the square |x|, |y| <= half_side with one arm hinged at each corner.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

#include "compensation/units.hpp"

namespace kphi::compensation {

/// Plain data; Compensator::build says whether it makes sense.
struct Airframe {
  Metres half_side;
  Metres arm_length;  ///< hinge to hub; longer than the propeller radius
  Metres propeller_radius;
  RadPerSec slowest_speed;  ///< speeds are held between these two
  RadPerSec fastest_speed;
  std::array<int, 4> hinge_turns{{0, 1, 2, 3}};  ///< corner of each arm: (half_side, half_side) turned by so many 90°
};

struct HubPosition {
  Metres x;
  Metres y;
};

/// Hub in the frame turned with the hinge. The square looks alike from each corner, so this frame serves all four arms.
/// θ = 45° points away from the body (X), 180° along the next edge (O).
[[nodiscard]] inline HubPosition hub_seen_from_hinge(const Airframe& airframe, Radians arm_angle) noexcept {
  return {airframe.half_side + airframe.arm_length * std::cos(arm_angle.value()),
          airframe.half_side + airframe.arm_length * std::sin(arm_angle.value())};
}

/// Hub of arm 0..3 in the body frame.
[[nodiscard]] inline HubPosition hub_in_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  const HubPosition hub = hub_seen_from_hinge(airframe, arm_angle);
  switch (airframe.hinge_turns[arm] & 3) {
    case 1:
      return {-hub.y, hub.x};
    case 2:
      return {-hub.x, -hub.y};
    case 3:
      return {hub.y, -hub.x};
    default:
      return hub;
  }
}

}  // namespace kphi::compensation
