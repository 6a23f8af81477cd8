// A morphing quadrotor seen from above: its body, four arms that turn about their hinges, a propeller at the end of
// each.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>

#include "compensation/convex_polygon.hpp"
#include "compensation/units.hpp"

namespace kphi::compensation {

using HubPosition = Position;

/// Where an arm is hinged on a body that is no square. Its hub is at `at` + arm_length (cos β, sin β), β = turn + θ, or
/// turn − θ where mirrored.
struct Hinge {
  Position at;
  Radians turn;
  bool mirrored = false;
};

/// A body in general: any convex outline, any four hinges.
struct PolygonBody {
  ConvexPolygon outline;
  std::array<Hinge, 4> hinges;
};

/// Plain data; Compensator::build says whether it makes sense. The body is the square |x|, |y| <= half_side with an arm
/// hinged at each corner, unless `polygon` gives another one.
struct Airframe {
  Metres half_side;
  Metres arm_length;  ///< hinge to hub; longer than the propeller radius
  Metres propeller_radius;
  RadPerSec slowest_speed;  ///< speeds are held between these two
  RadPerSec fastest_speed;
  std::array<int, 4> hinge_turns{{0, 1, 2, 3}};  ///< corner of each arm: (half_side, half_side) turned by so many 90°
  std::array<bool, 4> mirrored{};                ///< arms that fold the other way round: θ counts clockwise
  OverlapMeasure overlap = OverlapMeasure::rim_arc;  ///< how φ is measured; the curves must be fitted with the same
  std::optional<PolygonBody> polygon =
      std::nullopt;  ///< instead of the square: half_side, hinge_turns and mirrored do not count then
};

/// Hub on a square body, in the frame turned (and mirrored) with the hinge. The square looks alike from each corner, so
/// this frame serves all four arms. θ = 45° points away from the body (X), 180° along the next edge (O).
[[nodiscard]] inline HubPosition hub_seen_from_hinge(const Airframe& airframe, Radians arm_angle) noexcept {
  return {airframe.half_side + airframe.arm_length * std::cos(arm_angle.value()),
          airframe.half_side + airframe.arm_length * std::sin(arm_angle.value())};
}

/// Hub of an arm on a body that is no square, in the body frame.
[[nodiscard]] inline HubPosition hub_at_hinge(const Hinge& hinge, Metres arm_length, Radians arm_angle) noexcept {
  const double direction = (hinge.mirrored ? hinge.turn - arm_angle : hinge.turn + arm_angle).value();
  return {hinge.at.x + arm_length * std::cos(direction), hinge.at.y + arm_length * std::sin(direction)};
}

/// Hub of arm 0..3 in the body frame: c_i = Rot(90° turn_i) (a + L cos θ_i, a + L sin θ_i) on the square.
[[nodiscard]] inline HubPosition hub_in_body(const Airframe& airframe, std::size_t arm, Radians arm_angle) noexcept {
  if (airframe.polygon) return hub_at_hinge(airframe.polygon->hinges[arm], airframe.arm_length, arm_angle);
  HubPosition hub = hub_seen_from_hinge(airframe, arm_angle);
  if (airframe.mirrored[arm]) hub = {hub.y, hub.x};
  for (int turns = airframe.hinge_turns[arm] & 3; turns > 0; --turns) hub = {-hub.y, hub.x};
  return hub;
}

}  // namespace kphi::compensation
