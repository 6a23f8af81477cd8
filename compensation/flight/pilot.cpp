#include "compensation/flight/pilot.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::flight {
namespace {

using compensation::Compensator;
using compensation::Mixer;
using compensation::RotorLayout;

RotorLayout layout_of(const Vehicle& vehicle, const MassProperties& mass) noexcept {
  RotorLayout layout{Rotors<compensation::HubPosition>(vehicle.rotors()), vehicle.build.spin};
  for (std::size_t i = 0; i < vehicle.rotors(); ++i) {
    const Eigen::Vector2d lever = mass.hubs[i] - mass.cog;
    layout.hubs[i] = {Metres(lever.x()), Metres(lever.y())};
  }
  return layout;
}

Eigen::Vector3d held(const Eigen::Vector3d& error, const Eigen::Vector3d& limit) noexcept {
  return error.cwiseMax(-limit).cwiseMin(limit);
}

}  // namespace

Eigen::Vector3d pd_part(const Gains& gains, const Reference& reference, const BodyMotion& estimate) noexcept {
  const Eigen::Vector3d position = held(reference.position - estimate.position, gains.position_error_max);
  const Eigen::Vector3d velocity = held(reference.velocity - estimate.velocity, gains.velocity_error_max);
  return gains.position.cwiseProduct(position) + gains.velocity.cwiseProduct(velocity);
}

AccelerationDemand position_control(const Gains& gains, const Reference& reference, const BodyMotion& estimate,
                                    const Eigen::Quaterniond& attitude) noexcept {
  AccelerationDemand demand;
  demand.acceleration = pd_part(gains, reference, estimate) + reference.acceleration + Eigen::Vector3d(0, 0, kGravity);
  const Eigen::Vector3d up = attitude * Eigen::Vector3d::UnitZ();
  demand.collective = std::max(gains.smallest_collective, demand.acceleration.dot(up));
  return demand;
}

Eigen::Quaterniond attitude_along(const Eigen::Vector3d& acceleration, double yaw) noexcept {
  Eigen::Matrix3d axes;
  axes.col(2) = acceleration.normalized();
  axes.col(0) = Eigen::Vector3d(-std::sin(yaw), std::cos(yaw), 0).cross(axes.col(2)).normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return Eigen::Quaterniond(axes);
}

Eigen::Vector3d attitude_control(const Gains& gains, const Eigen::Quaterniond& attitude,
                                 const Eigen::Quaterniond& wanted) noexcept {
  const Eigen::Quaterniond error = attitude.conjugate() * wanted;
  const double sign = error.w() < 0 ? -2 : 2;
  return sign * gains.attitude.cwiseProduct(error.vec());
}

Eigen::Vector3d rates_along(const Eigen::Vector3d& jerk, double collective,
                            const Eigen::Quaterniond& attitude) noexcept {
  const Eigen::Vector3d in_body = attitude.conjugate() * jerk;
  return {-in_body.y() / collective, in_body.x() / collective, 0};
}

RateControl::RateControl(const Gains& gains, double rotor_lag) noexcept : rate_(gains.rate), lag_(rotor_lag) {
  const Eigen::Array3d lead = rotor_lag * gains.rate.array();
  stiffening_ = lead + (lead.square() + 1 + gains.torque_weight).sqrt();
}

Eigen::Vector3d RateControl::torque(const Eigen::Vector3d& wanted_rates, const Eigen::Vector3d& feedback_rates,
                                    const Eigen::Vector3d& rates, const Eigen::Matrix3d& inertia) const noexcept {
  const Eigen::Vector3d error = wanted_rates + feedback_rates - rates;
  const Eigen::Vector3d reference = wanted_rates.cross(inertia * wanted_rates);
  const Eigen::Vector3d lead = (stiffening_.array() - 1) * (reference - rotor_torque_).array();
  return inertia * stiffening_.cwiseProduct(rate_).cwiseProduct(error) + lead + rates.cross(inertia * rates);
}

void RateControl::applied(const Eigen::Vector3d& torque, double width) noexcept {
  rotor_torque_ += (1 - std::exp(-width / lag_)) * (torque - rotor_torque_);
}

std::optional<Pilot> Pilot::build(const Vehicle& vehicle, const compensation::Rotors<compensation::ThrustCurve>& curves,
                                  const PilotSettings& settings) {
  const auto built = Compensator::build(curves, vehicle.airframe);
  const auto mixer =
      Mixer::build(layout_of(vehicle, mass_properties(vehicle, vehicle.x)), {Metres(vehicle.build.yaw_arm_m), 0.0});
  if (!built.compensator || !mixer) return std::nullopt;
  Mixer in_o = *mixer;
  if (!in_o.set_layout(layout_of(vehicle, mass_properties(vehicle, vehicle.o)))) return std::nullopt;
  return Pilot(vehicle, settings, *built.compensator, *mixer);
}

Pilot::Pilot(const Vehicle& vehicle, const PilotSettings& settings, const Compensator& compensator,
             const Mixer& mixer) noexcept
    : vehicle_(vehicle),
      settings_(settings),
      compensator_(compensator),
      mixer_(mixer),
      rate_control_(settings.gains, vehicle.build.rotor_lag_s),
      mass_(mass_properties(vehicle, vehicle.x)),
      arms_(vehicle.x) {}

void Pilot::compensate(bool on) noexcept {
  compensator_.enable(on);
  allocate();
}

void Pilot::set_arms(const Angles& arms) noexcept {
  if (arms == arms_) return;
  arms_ = arms;
  mass_ = mass_properties(vehicle_, arms);
  Angles as_wired = arms;
  for (std::size_t i = 0; i < settings_.arm_order.size(); ++i) as_wired[i] = arms[settings_.arm_order[i]];
  tell(as_wired);
  allocate();
}

void Pilot::tell(const Angles& arms) noexcept {
  if (vehicle_.ways.size() == 0) return compensator_.set_arms(arms);
  Rotors<compensation::HubPosition> hubs(arms.size());
  for (std::size_t i = 0; i < arms.size(); ++i) hubs[i] = hub_of(vehicle_, i, arms[i]);
  compensator_.set_hubs(hubs);
}

void Pilot::allocate() noexcept { mixer_.set_layout(layout_of(vehicle_, mass_), compensator_.drag_scale()); }

void Pilot::look(const Reference& reference, const BodyMotion& estimate, const Eigen::Quaterniond& attitude) noexcept {
  const AccelerationDemand demand = position_control(settings_.gains, reference, estimate, attitude);
  collective_ = demand.collective;
  const Eigen::Quaterniond wanted = attitude_along(demand.acceleration, 0.0);
  feedback_rates_ = attitude_control(settings_.gains, attitude, wanted);
  wanted_rates_ = rates_along(reference.jerk, collective_, wanted);
}

RotorSpeeds Pilot::act(const Eigen::Vector3d& body_rates) noexcept {
  const Eigen::Vector3d torque = rate_control_.torque(wanted_rates_, feedback_rates_, body_rates, mass_.inertia);
  compensation::ThrustLimits limits;
  limits.largest = compensator_.thrust_max();
  const auto mixed = mixer_.mix({Newtons(mass_.mass_kg * collective_), NewtonMetres(torque.x()),
                                 NewtonMetres(torque.y()), NewtonMetres(torque.z())},
                                limits, NewtonMetres(settings_.assured_yaw));
  rate_control_.applied({mixed.achieved.roll.value(), mixed.achieved.pitch.value(), mixed.achieved.yaw.value()}, kStep);
  concessions_ += mixed.concessions.any() ? 1 : 0;
  thrusts_ = mixed.thrusts;
  const auto command = compensator_.speeds_for(mixed.thrusts);
  RotorSpeeds speeds = RotorSpeeds::Zero();
  for (std::size_t i = 0; i < command.speeds.size(); ++i)
    speeds[static_cast<Eigen::Index>(i)] = command.speeds[i].value();
  return speeds;
}

}  // namespace kphi::flight
