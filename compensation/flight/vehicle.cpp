#include "compensation/flight/vehicle.hpp"

#include <Eigen/LU>
#include <cmath>

namespace kphi::flight {
namespace {

/// Of a point mass at (x, y, 0), about the origin.
Eigen::Matrix3d point_inertia(double mass, const Eigen::Vector2d& at) noexcept {
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  inertia(0, 0) = mass * at.y() * at.y();
  inertia(1, 1) = mass * at.x() * at.x();
  inertia(2, 2) = mass * at.squaredNorm();
  inertia(0, 1) = inertia(1, 0) = -mass * at.x() * at.y();
  return inertia;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) noexcept { return a.x() * b.y() - a.y() * b.x(); }

}  // namespace

MassProperties mass_properties(const Vehicle& vehicle, const Angles& arms, const std::array<double, 4>& rates,
                               const Eigen::Vector2d& plate_offset) noexcept {
  const Build& build = vehicle.build;
  const double plate = build.mass_kg - 4 * build.hub_mass_kg;
  const double side = 2 * vehicle.airframe.half_side.value();
  const double flat = plate * side * side / 12, tall = plate * build.body_height_m * build.body_height_m / 12;
  MassProperties found;
  found.mass_kg = build.mass_kg;
  found.inertia = point_inertia(plate, plate_offset);
  found.inertia.diagonal() += Eigen::Vector3d(flat + tall, flat + tall, 2 * flat);
  found.cog = plate * plate_offset;
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const compensation::HubPosition at = hub_in_body(vehicle.airframe, i, arms[i]);
    const compensation::HubPosition quarter_on = hub_in_body(vehicle.airframe, i, arms[i] + Radians(kPi / 2));
    const compensation::HubPosition hinge_twice = hub_in_body(vehicle.airframe, i, arms[i] + Radians(kPi));
    const Eigen::Vector2d hub(at.x.value(), at.y.value());
    const Eigen::Vector2d hinge = (hub + Eigen::Vector2d(hinge_twice.x.value(), hinge_twice.y.value())) / 2;
    const Eigen::Vector2d speed = rates[i] * (Eigen::Vector2d(quarter_on.x.value(), quarter_on.y.value()) - hinge);
    found.hubs[i] = hub;
    found.cog += build.hub_mass_kg * hub;
    found.cog_rate += build.hub_mass_kg * speed;
    found.inertia += point_inertia(build.hub_mass_kg, hub);
    found.arm_momentum += build.hub_mass_kg * cross(hub, speed);
  }
  found.cog /= build.mass_kg;
  found.cog_rate /= build.mass_kg;
  found.arm_momentum -= build.mass_kg * cross(found.cog, found.cog_rate);
  found.inertia -= point_inertia(build.mass_kg, found.cog);
  found.inverse_inertia = found.inertia.inverse();
  return found;
}

}  // namespace kphi::flight
