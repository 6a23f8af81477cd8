#include "compensation/flight/control.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::flight {
namespace {

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

}  // namespace kphi::flight
