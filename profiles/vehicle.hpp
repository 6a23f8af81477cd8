// What a vehicle file says: the body, the arms and the propellers of a morphing quadrotor (facts of geometry:
// square body |x|, |y| <= half_side, one arm hinged at each corner, all SI).
#pragma once

#include <array>
#include <map>
#include <string>

#include "compensation/units.hpp"

namespace kphi::profiles {

struct Vehicle {
  std::string name;
  Metres half_side;
  Metres arm_length;
  Metres propeller_radius;
  std::array<double, 4> hinge_turn_deg{};                ///< 0, 90, 180, 270: corner of each arm
  std::map<std::string, std::array<Radians, 4>> shapes;  ///< X, H, O, T: arm angles
  Radians arm_angle_min;
  Radians arm_angle_max;
  RadPerSec speed_min;
  RadPerSec speed_max;
  std::string text;
  std::string path;
};

[[nodiscard]] Vehicle load_vehicle(const std::string& path);
[[nodiscard]] Vehicle parse_vehicle(const std::string& text, const std::string& path);

}  // namespace kphi::profiles
