// The occlusion angle φ of one arm of a vehicle.
#pragma once

#include <cstddef>

#include "compensation/airframe.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// Where the hub of arm 0..3 stands beside the outline that covers it: in the body frame, on a square body turned and
/// mirrored with the hinge, as the square looks alike from each of its corners.
[[nodiscard]] inline HubPosition hub_beside_body(const Airframe& airframe, std::size_t arm,
                                                 Radians arm_angle) noexcept {
  if (airframe.polygon) return hub_at_hinge(airframe.polygon->hinges[arm], airframe.arm_length, arm_angle);
  return hub_seen_from_hinge(airframe, arm_angle);
}

/// φ in [0, 2π] rad of a disk there, in the airframe's overlap measure. The rim over a square body by its closed form
/// (rim_arc.hpp), all else by occlusion_angle (convex_polygon.hpp). Never NaN: 0 where an argument is.
[[nodiscard]] Radians occlusion_beside_body(const Airframe& airframe, HubPosition hub) noexcept;

/// φ of arm 0..3 at this angle.
[[nodiscard]] inline Radians occlusion_of_arm(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  return occlusion_beside_body(airframe, hub_beside_body(airframe, arm, arm_angle));
}

}  // namespace kphi::compensation
