#include "compensation/airframe.hpp"

#include <cmath>

#include "compensation/strict_math.hpp"

namespace kphi::compensation {
namespace {

HubPosition on_circle(Position middle, Metres radius, Radians direction) noexcept {
  return {middle.x + radius * std::cos(direction.value()), middle.y + radius * std::sin(direction.value())};
}

}  // namespace

HubPosition hub_seen_from_hinge(const Airframe& airframe, Radians arm_angle) noexcept {
  return on_circle({airframe.half_side, airframe.half_side}, airframe.arm_length, arm_angle);
}

HubPosition hub_at_hinge(const Hinge& hinge, Metres arm_length, Radians arm_angle) noexcept {
  return on_circle(hinge.at, arm_length, hinge.mirrored ? hinge.turn - arm_angle : hinge.turn + arm_angle);
}

HubPosition hub_in_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  if (airframe.polygon) return hub_at_hinge(airframe.polygon->hinges[arm], airframe.arm_length, arm_angle);
  HubPosition hub = hub_seen_from_hinge(airframe, arm_angle);
  if (airframe.mirrored[arm]) hub = {hub.y, hub.x};
  for (int turns = airframe.hinge_turns[arm] & 3; turns > 0; --turns) hub = {-hub.y, hub.x};
  return hub;
}

}  // namespace kphi::compensation
