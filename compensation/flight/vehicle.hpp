// The foldable drone as a mechanism: a plate with four arms that turn in its plane, each with a point mass at its hub.
#pragma once

#include <Eigen/Core>
#include <array>

#include "compensation/airframe.hpp"

namespace kphi::flight {

using Angles = std::array<Radians, 4>;

/// What the vehicle is made of. The paper gives none of these; they are assumed for a drone of its size.
struct Build {
  double mass_kg = 0.60;                               ///< all of it
  double hub_mass_kg = 0.045;                          ///< motor, propeller and servo of one arm, a point at the hub
  double body_height_m = 0.040;                        ///< the body is a plate, 2 half sides square
  double yaw_arm_m = 0.0133;                           ///< κ: rotor torque per thrust without occlusion
  double rotor_lag_s = 0.033;                          ///< time constant of a rotor's speed
  std::array<double, 4> spin{{1.0, -1.0, 1.0, -1.0}};  ///< sign of the torque on the body
};

enum class Shape { x, o };

struct Vehicle {
  compensation::Airframe airframe;
  Angles x;  ///< arm angles of the shape X
  Angles o;  ///< arm angles of the shape O
  Build build;

  [[nodiscard]] const Angles& angles(Shape shape) const noexcept { return shape == Shape::x ? x : o; }
};

/// The hub masses' motion is prescribed, so all that the arms do to the rigid-body equations is in these numbers.
struct MassProperties {
  double mass_kg = 0;
  std::array<Eigen::Vector2d, 4> hubs;  ///< m, in the body frame
  Eigen::Vector2d cog{0, 0};            ///< m, in the body frame
  Eigen::Vector2d cog_rate{0, 0};       ///< m/s, as the arms move
  Eigen::Matrix3d inertia;              ///< kg m², about the centre of gravity
  Eigen::Matrix3d inverse_inertia;
  double arm_momentum = 0;  ///< N m s about z: angular momentum of the arms' motion relative to the body
};

/// `rates` are the arms' angular speeds [rad/s]; `plate_offset` [m] moves the plate away from the middle of the square.
[[nodiscard]] MassProperties mass_properties(const Vehicle& vehicle, const Angles& arms,
                                             const std::array<double, 4>& rates,
                                             const Eigen::Vector2d& plate_offset = Eigen::Vector2d::Zero()) noexcept;

}  // namespace kphi::flight
