#include "compensation/flight/aircraft.hpp"

namespace kphi::flight {
namespace {

Eigen::Vector3d flat(const Eigen::Vector2d& v) noexcept { return {v.x(), v.y(), 0}; }

}  // namespace

Aircraft::Aircraft(const Vehicle& vehicle, const Truth& truth, const Shadow& shadow) noexcept
    : vehicle_(vehicle), truth_(truth), shadow_(&shadow) {
  vehicle_.build.mass_kg *= truth.mass;
  vehicle_.build.hub_mass_kg *= truth.mass;
}

Configuration Aircraft::configuration(const Angles& arms, const Rotors<double>& rates) const noexcept {
  const Build& build = vehicle_.build;
  Angles true_arms = arms;
  for (std::size_t i = 0; i < arms.size(); ++i) true_arms[i] = arms[i] + Radians(truth_.arm_error[i]);
  const double plate = build.mass_kg - static_cast<double>(arms.size()) * build.hub_mass_kg;
  Configuration found;
  found.thrust_per_square.resize(arms.size());
  found.torque_per_square.resize(arms.size());
  found.mass = mass_properties(vehicle_, true_arms, rates, truth_.cog_error * (build.mass_kg / plate));
  for (std::size_t i = 0; i < arms.size(); ++i) {
    const double uncovered = truth_.thrust_coefficient.value() * truth_.thrust[i];
    found.thrust_per_square[i] =
        uncovered * thrust_share_in_flight(truth_.law, truth_.gamma, *shadow_, i, true_arms[i]);
    found.torque_per_square[i] = build.spin[i] * build.yaw_arm_m * uncovered;
  }
  return found;
}

AircraftState::Vector Aircraft::slope(const AircraftState::Vector& y, const Configuration& configuration,
                                      const RotorSpeeds& commanded_speeds) const noexcept {
  const MassProperties& mass = configuration.mass;
  double thrust = 0;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < mass.hubs.size(); ++i) {
    const double speed = y[static_cast<Eigen::Index>(13 + i)];
    const double square = speed * speed, force = configuration.thrust_per_square[i] * square;
    const Eigen::Vector2d lever = mass.hubs[i] - mass.cog;
    thrust += force;
    torque += Eigen::Vector3d(lever.y() * force, -lever.x() * force, configuration.torque_per_square[i] * square);
  }
  const Eigen::Vector3d momentum = y.segment<3>(10);
  const Eigen::Vector3d rates = mass.inverse_inertia * (momentum - Eigen::Vector3d(0, 0, mass.arm_momentum));
  const double w = y[6];
  const Eigen::Vector3d v = y.segment<3>(7);
  const Eigen::Vector3d up = 2 * Eigen::Vector3d(v.x() * v.z() + w * v.y(), v.y() * v.z() - w * v.x(),
                                                 0.5 * (w * w + v.z() * v.z() - v.x() * v.x() - v.y() * v.y()));
  AircraftState::Vector dy;
  dy.segment<3>(0) = y.segment<3>(3);
  dy.segment<3>(3) = thrust / (mass.mass_kg * y.segment<4>(6).squaredNorm()) * up -
                     truth_.drag * (y.segment<3>(3) - truth_.wind) - Eigen::Vector3d(0, 0, kGravity);
  dy[6] = -0.5 * v.dot(rates);
  dy.segment<3>(7) = 0.5 * (w * rates + v.cross(rates));
  dy.segment<3>(10) = torque - rates.cross(momentum);
  dy.segment<kMostRotors>(13) = (commanded_speeds - y.segment<kMostRotors>(13)) / vehicle_.build.rotor_lag_s;
  return dy;
}

AircraftState Aircraft::step(const AircraftState& state, double width,
                             const std::array<const Configuration*, 3>& stages,
                             const RotorSpeeds& commanded_speeds) const noexcept {
  AircraftState next;
  next.y = runge_kutta_step(state.y, width, [&](std::size_t stage, const AircraftState::Vector& y) {
    return slope(y, *stages[stage], commanded_speeds);
  });
  next.y.segment<4>(6) /= next.y.segment<4>(6).norm();
  return next;
}

BodyMotion body_motion(const AircraftState& state, const MassProperties& mass) noexcept {
  const Eigen::Matrix3d rotation = state.attitude().toRotationMatrix();
  const Eigen::Vector3d cog = flat(mass.cog);
  return {state.position() - rotation * cog,
          state.velocity() - rotation * (body_rates(state, mass).cross(cog) + flat(mass.cog_rate))};
}

AircraftState level_state(const BodyMotion& motion, const MassProperties& mass, double speed) noexcept {
  AircraftState state;
  state.position() = motion.position + flat(mass.cog);
  state.velocity() = motion.velocity + flat(mass.cog_rate);
  state.y[6] = 1;
  state.momentum().z() = mass.arm_momentum;
  state.rotors().head(static_cast<Eigen::Index>(mass.hubs.size())).setConstant(speed);
  return state;
}

}  // namespace kphi::flight
