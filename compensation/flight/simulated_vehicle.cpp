#include "compensation/flight/simulated_vehicle.hpp"

#include <Eigen/LU>

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

Eigen::Vector2d vector(const compensation::Position& at) noexcept { return {at.x.value(), at.y.value()}; }

/// By how much the hub moves as the arm does, m/rad: from its hinge to it, a quarter of a turn on.
Eigen::Vector2d lever_of(const Vehicle& vehicle, std::size_t arm, Radians at, const Eigen::Vector2d& hub) noexcept {
  if (vehicle.ways.size() != 0) return vector(vehicle.ways[arm].to) - vector(vehicle.ways[arm].from);
  const Eigen::Vector2d hinge = (hub + vector(hub_in_body(vehicle.airframe, arm, at + Radians(kPi)))) / 2;
  return vector(hub_in_body(vehicle.airframe, arm, at + Radians(kPi / 2))) - hinge;
}

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) noexcept { return a.x() * b.y() - a.y() * b.x(); }

/// Of the area of all parts of a body: its middle [m], and the means of x², y² and xy about it [m²].
struct AreaMoments {
  Eigen::Vector2d middle;
  double xx = 0, yy = 0, xy = 0;
};

/// By Green's theorem: the triangles between the origin and each edge.
AreaMoments area_moments(const compensation::Airframe& airframe) noexcept {
  double area = 0, xx = 0, yy = 0, xy = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  const auto add = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d sum = a + b;
    const double triangle = cross(a, b) / 2;
    area += triangle;
    first += triangle / 3 * sum;
    xx += triangle / 6 * (a.x() * sum.x() + b.x() * b.x());
    yy += triangle / 6 * (a.y() * sum.y() + b.y() * b.y());
    xy += triangle / 12 * (a.x() * (a.y() + sum.y()) + b.x() * (b.y() + sum.y()));
  };
  for_each_part(airframe, [&](const compensation::ConvexPolygon& part) {
    for (std::size_t i = 0; i < part.size(); ++i)
      add(vector(part.corner(i)), vector(part.corner((i + 1) % part.size())));
  });
  const Eigen::Vector2d middle = first / area;
  return {middle, xx / area - middle.x() * middle.x(), yy / area - middle.y() * middle.y(),
          xy / area - middle.x() * middle.y()};
}

/// Of the body without its hubs, about its own middle.
Eigen::Matrix3d body_inertia(const Build& build, double mass, const AreaMoments& area) noexcept {
  if (build.body_inertia) return build.body_inertia->asDiagonal();
  const double tall = build.body_height_m * build.body_height_m / 12;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  inertia.diagonal() = mass * Eigen::Vector3d(area.yy + tall, area.xx + tall, area.xx + area.yy);
  inertia(0, 1) = inertia(1, 0) = -mass * area.xy;
  return inertia;
}

}  // namespace

compensation::HubPosition hub_of(const Vehicle& vehicle, std::size_t rotor, Radians at) noexcept {
  if (vehicle.ways.size() == 0) return hub_in_body(vehicle.airframe, rotor, at);
  const Way& way = vehicle.ways[rotor];
  const double share = at.value();
  return {way.from.x + share * (way.to.x - way.from.x), way.from.y + share * (way.to.y - way.from.y)};
}

MassProperties mass_properties(const Vehicle& vehicle, const Angles& arms, const Rotors<double>& rates,
                               const Eigen::Vector2d& plate_offset) noexcept {
  const Build& build = vehicle.build;
  const double plate = build.mass_kg - static_cast<double>(arms.size()) * build.hub_mass_kg;
  const AreaMoments area = area_moments(vehicle.airframe);
  const Eigen::Vector2d middle = area.middle + plate_offset;
  MassProperties found;
  found.hubs.resize(arms.size());
  found.mass_kg = build.mass_kg;
  // About the origin first, then about the common centre of gravity c (Steiner's theorem): J = Σ (J_own + m r²) − M c².
  // So the body's distance from c counts as the hubs' do: in T of the foldable drone 17.55 mm, 0.129e-3 kg m² of J_xx
  // and J_zz.
  found.inertia = body_inertia(build, plate, area) + point_inertia(plate, middle);
  found.cog = plate * middle;
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const Eigen::Vector2d hub = vector(hub_of(vehicle, i, arms[i]));
    const Eigen::Vector2d speed =
        i < rates.size() ? Eigen::Vector2d(rates[i] * lever_of(vehicle, i, arms[i], hub)) : Eigen::Vector2d(0, 0);
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
