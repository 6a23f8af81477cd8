// What a vehicle file says: the body, the arms and the propellers of a morphing multirotor, all SI. The body is the
// square |x|, |y| <= half_side with one arm hinged at each corner, a quadrotor, or any convex outline with 3 to 8
// hinges; or the file gives the places of 3 to 8 hubs in each shape, of arms that are no hinge and an angle.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "compensation/airframe.hpp"
#include "compensation/flight/pilot.hpp"
#include "compensation/units.hpp"

namespace kphi::profiles {

using compensation::Rotors;

struct Vehicle {
  std::string name;
  Metres half_side;      ///< 0 if `body` is given
  Metres arm_length{0};  ///< 0 if `hubs` are given
  Metres propeller_radius;
  std::array<double, 4> hinge_turn_deg{};         ///< 0, 90, 180, 270: corner of each arm
  std::array<bool, 4> arm_mirrored{};             ///< arms whose angle counts clockwise
  std::optional<compensation::PolygonBody> body;  ///< instead of the square; without hinges if `hubs` are given
  compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc;  ///< how φ is measured in flight
  std::map<std::string, Rotors<Radians>> shapes;                  ///< X, H, O, T or any other name: arm angles
  std::map<std::string, Rotors<compensation::HubPosition>> hubs;  ///< instead of `shapes`: of each shape, body frame
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

/// 3 to 8.
[[nodiscard]] std::size_t rotors_of(const Vehicle& vehicle);
/// The names of its shapes.
[[nodiscard]] std::vector<std::string> shapes_of(const Vehicle& vehicle);
/// In the body frame, in a shape that it has.
[[nodiscard]] Rotors<compensation::HubPosition> hubs_of(const Vehicle& vehicle, const std::string& shape);

/// As the library that flies wants it; Compensator::build accepts it. With `hubs` its arms mean nothing: tell it hubs.
[[nodiscard]] compensation::Airframe airframe_of(const Vehicle& vehicle);

}  // namespace kphi::profiles
