// What a vehicle file says: the body, the arms and the propellers of a morphing quadrotor, all SI. The body is the
// square |x|, |y| <= half_side with one arm hinged at each corner, or any convex outline with four hinges.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

#include "compensation/airframe.hpp"
#include "compensation/units.hpp"

namespace kphi::profiles {

/// What only a simulated flight needs to know of the mechanism.
struct Dynamics {
  double mass_kg = 0;      ///< all of it
  double hub_mass_kg = 0;  ///< motor, propeller and servo of one arm, a point at the hub
  Metres body_height;      ///< the rest is a plate of the body's outline, this high; 0 if `body_inertia_kg_m2` is given
  std::optional<std::array<double, 3>> body_inertia_kg_m2;  ///< of the body without hubs, about its middle: x, y, z
  Metres drag_torque_per_thrust;                            ///< κ, without occlusion [N m/N]
  Seconds rotor_lag;                                        ///< time constant of a rotor's speed
  double air_drag_per_s = 0;                                ///< force per mass and air speed
  Seconds morph;                                            ///< from one shape to the next
  std::array<int, 4> rotor_spins{};                         ///< +1 where the drag torque points along +z, −1 else
};

/// Gains of the position, attitude and body-rate control; x, y, z or roll, pitch, yaw.
struct Control {
  std::array<double, 3> position_gain_per_s2{};
  std::array<double, 3> velocity_gain_per_s{};
  std::array<double, 3> attitude_gain_per_s{};
  std::array<double, 3> rate_gain_per_s{};
  double torque_weight = 0;  ///< of the body-rate LQR, with that of the input 1
  std::array<double, 3> position_error_max_m{};
  std::array<double, 3> velocity_error_max_m_s{};
  double collective_min_m_s2 = 0;
  NewtonMetres assured_yaw;  ///< what the saturation leaves to yaw
};

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
  std::optional<Dynamics> dynamics;  ///< for `kphi fly`, as is control
  std::optional<Control> control;
  std::string text;
  std::string path;
};

[[nodiscard]] Vehicle load_vehicle(const std::string& path);
[[nodiscard]] Vehicle parse_vehicle(const std::string& text, const std::string& path);

/// As the library that flies wants it; Compensator::build accepts it.
[[nodiscard]] compensation::Airframe airframe_of(const Vehicle& vehicle);

}  // namespace kphi::profiles
