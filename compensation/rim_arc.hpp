// How much of a propeller's rim lies over the body: the occlusion angle φ of the paper ("near the tips").
// The body is the square |x|, |y| <= half_side; the arm is hinged at its corner (half_side, half_side).
#pragma once

#include "compensation/units.hpp"

namespace kphi::compensation {

/// Length in radians, [0, 2π], of the rim of the disk (hub_x, hub_y, radius) that lies inside the square.
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

}  // namespace kphi::compensation
