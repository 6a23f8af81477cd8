// What a vehicle file says: the body, the arms and the propellers of a morphing quadrotor, all SI. The body is the
// square |x|, |y| <= half_side with one arm hinged at each corner, or any convex outline with four hinges.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "compensation/airframe.hpp"
#include "compensation/flight/pilot.hpp"
#include "compensation/units.hpp"

namespace kphi::profiles {

struct Vehicle {
  std::string name;
  Metres half_side;  ///< 0 if `body` is given
  Metres arm_length;
  Metres propeller_radius;
  std::array<double, 4> hinge_turn_deg{};         ///< 0, 90, 180, 270: corner of each arm
  std::array<bool, 4> arm_mirrored{};             ///< arms whose angle counts clockwise
  std::optional<compensation::PolygonBody> body;  ///< instead of the square
  compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc;  ///< how φ is measured in flight
  std::map<std::string, std::array<Radians, 4>> shapes;                          ///< X, H, O, T: arm angles
  Radians arm_angle_min;
  Radians arm_angle_max;
  RadPerSec speed_min;
  RadPerSec speed_max;
  std::optional<flight::Build> dynamics;  ///< for `kphi fly`, as is control
  std::optional<flight::PilotSettings> control;
  std::string text;
  std::string path;
};

[[nodiscard]] Vehicle load_vehicle(const std::string& path);
[[nodiscard]] Vehicle parse_vehicle(const std::string& text, const std::string& path);

/// As the library that flies wants it; Compensator::build accepts it.
[[nodiscard]] compensation::Airframe airframe_of(const Vehicle& vehicle);

}  // namespace kphi::profiles
