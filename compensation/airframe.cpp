#include "compensation/airframe.hpp"

#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {

HubPosition hub_beside_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  Position hinge{airframe.half_side, airframe.half_side};
  Real direction = arm_angle.value();
  if (airframe.polygon) {
    const Hinge& own = airframe.polygon->hinges[arm];
    hinge = own.at;
    direction = own.turn.value() + (own.mirrored ? -direction : direction);
  }
  return {hinge.x + airframe.arm_length * std::cos(direction), hinge.y + airframe.arm_length * std::sin(direction)};
}

HubPosition hub_in_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  HubPosition hub = hub_beside_body(airframe, arm, arm_angle);
  if (airframe.polygon) return hub;
  if (airframe.mirrored[arm]) hub = {hub.y, hub.x};
  for (int turns = airframe.hinge_turns[arm] & 3; turns > 0; --turns) hub = {-hub.y, hub.x};
  return hub;
}

}  // namespace kphi::compensation
