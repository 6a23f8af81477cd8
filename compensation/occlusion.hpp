// The occlusion angle φ of one arm of a vehicle: how much of the propeller's disk lies over the body (in the paper
// "near the tips"). Here the closed form over the square body; any other body in convex_polygon.hpp.
#pragma once

#include <cstddef>

#include "compensation/airframe.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

/// Length in radians, [0, 2π], of the rim of the disk (hub_x, hub_y, radius) that lies inside the square |x|, |y| <=
/// half_side; the arm is hinged at its corner (half_side, half_side).
/// Blind to a body wholly under the disk (then 0). Steep at tangency: 1 µm over an edge is already 0.6°. Never NaN:
/// where an argument is NaN, or the square is at least one radius away, the answer is 0.
[[nodiscard]] Radians rim_arc(Metres half_side, Metres radius, Metres hub_x, Metres hub_y) noexcept;

/// Arm angles, within [−90°, 180°] and symmetric about 45°, at which the disk does not touch the body.
struct ContactFreeWindow {
  Radians from;
  Radians to;
  [[nodiscard]] constexpr bool contains(Radians arm_angle) const noexcept {
    return arm_angle >= from && arm_angle <= to;
  }
};

/// The window between the first contacts on either side: with the next corner or, on long bodies, with the edge. Empty
/// when the arm is no longer than the propeller radius: its own corner is covered then at every angle.
[[nodiscard]] ContactFreeWindow contact_free_window(Metres half_side, Metres arm_length, Metres radius) noexcept;

/// φ in [0, 2π] rad of this rotor's disk where hub_beside_body() tells, in the airframe's overlap measure. The rim over
/// a square body by rim_arc, all else by occlusion_angle. Never NaN: 0 where an argument is.
[[nodiscard]] Radians occlusion_beside_body(const Airframe& airframe, std::size_t rotor, HubPosition hub) noexcept;

/// φ of an arm at this angle.
[[nodiscard]] inline Radians occlusion_of_arm(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  return occlusion_beside_body(airframe, arm, hub_beside_body(airframe, arm, arm_angle));
}

}  // namespace kphi::compensation
