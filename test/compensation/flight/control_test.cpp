#include "compensation/flight/control.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/noise.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

const Eigen::Quaterniond kLevel = Eigen::Quaterniond::Identity();

BodyMotion at(const Eigen::Vector3d& position, const Eigen::Vector3d& velocity = {0, 0, 0}) {
  return {position, velocity};
}

TEST(PositionControl, DemandsOnlyGravityOnTheReference) {
  const Reference reference;
  const AccelerationDemand demand = position_control(example_gains(), reference, at(reference.position), kLevel);
  EXPECT_EQ(demand.acceleration, Eigen::Vector3d(0, 0, kGravity));
  EXPECT_EQ(demand.collective, kGravity);
}

TEST(PositionControl, WeighsErrorsWithItsGainsAndCarriesTheReferencesAcceleration) {
  Reference reference;
  reference.acceleration = {0.1, 0.2, 0.3};
  const BodyMotion estimate = at(reference.position - Eigen::Vector3d(0.1, -0.2, 0.05), {-0.5, 0.25, 0.1});
  const AccelerationDemand demand = position_control(example_gains(), reference, estimate, kLevel);
  const Eigen::Vector3d wanted(6 * 0.1 + 4 * 0.5 + 0.1, -6 * 0.2 - 4 * 0.25 + 0.2,
                               15 * 0.05 - 6 * 0.1 + 0.3 + kGravity);
  EXPECT_LT((demand.acceleration - wanted).norm(), 1e-12);
}

TEST(PositionControl, HoldsEachErrorWithinItsLimit) {
  const Reference reference;
  const BodyMotion far = at(reference.position - Eigen::Vector3d(9, -9, 9), {-9, 9, -9});
  const Eigen::Vector3d pd = pd_part(example_gains(), reference, far);
  EXPECT_LT((pd - Eigen::Vector3d(6 * 0.6 + 4, -6 * 0.6 - 4, 15 * 0.3 + 6 * 0.75)).norm(), 1e-12);
}

TEST(PositionControl, CountsOnlyWhatTheActualAttitudeCanGiveAndNeverStopsTheRotors) {
  const Reference reference;
  const Eigen::Quaterniond tilted(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  EXPECT_NEAR(position_control(example_gains(), reference, at(reference.position), tilted).collective,
              kGravity * std::cos(0.3), 1e-12);
  const Eigen::Quaterniond inverted(Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()));
  EXPECT_EQ(position_control(example_gains(), reference, at(reference.position), inverted).collective, 1.0);
}

TEST(AttitudeAlong, PutsBodyZAlongTheAccelerationAndTheNoseWhereYawPoints) {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d acceleration(random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(1, 15));
    const double yaw = random.uniform(-3, 3);
    const Eigen::Matrix3d axes = attitude_along(acceleration, yaw).toRotationMatrix();
    EXPECT_LT((axes.col(2) - acceleration.normalized()).norm(), 1e-12);
    EXPECT_NEAR(axes.col(0).dot(Eigen::Vector3d(-std::sin(yaw), std::cos(yaw), 0)), 0, 1e-12);
    EXPECT_GT(axes.col(0).dot(Eigen::Vector3d(std::cos(yaw), std::sin(yaw), 0)), 0);
  }
}

TEST(AttitudeControl, TurnsTheShortWayRoundWithTwiceTheGainTimesHalfTheAngle) {
  const Gains gains = example_gains();
  const double angle = 0.01;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    Eigen::Quaterniond wanted(Eigen::AngleAxisd(angle, Eigen::Vector3d::Unit(axis)));
    EXPECT_NEAR(attitude_control(gains, kLevel, wanted)[axis], gains.attitude[axis] * angle, 1e-6);
    wanted.coeffs() *= -1;  // the same attitude
    EXPECT_NEAR(attitude_control(gains, kLevel, wanted)[axis], gains.attitude[axis] * angle, 1e-6);
  }
}

TEST(RatesAlong, AreThoseOfTheAttitudeThatFollowsTheAcceleration) {
  const double t = 0.7, h = 1e-4;
  const auto attitude = [&](double time) {
    return attitude_along(reference_at(Path::rising_circle, time).acceleration + Eigen::Vector3d(0, 0, kGravity), 0);
  };
  const Reference reference = reference_at(Path::rising_circle, t);
  const double collective = (reference.acceleration + Eigen::Vector3d(0, 0, kGravity)).norm();
  const Eigen::Quaterniond turn = attitude(t - h).conjugate() * attitude(t + h);
  const Eigen::Vector3d rates = turn.vec() / h;
  const Eigen::Vector3d found = rates_along(reference.jerk, collective, attitude(t));
  EXPECT_NEAR(found.x(), rates.x(), 1e-6);
  EXPECT_NEAR(found.y(), rates.y(), 1e-6);
}

// The Riccati equation of (ω, τ): A = [0 1/J; 0 −1/α], B = [0; 1/α], Q = diag(p, d), R = 1, K = Bᵀ S.
TEST(RateControl, IsTheLinearQuadraticRegulatorThatItSaysItIs) {
  Random random(6);
  for (int i = 0; i < 200; ++i) {
    Gains gains = example_gains();
    const double rate = random.uniform(2, 30), inertia = random.uniform(5e-4, 1e-2), lag = random.uniform(0.01, 0.06);
    gains.rate.setConstant(rate);
    gains.torque_weight = random.uniform(0, 3);
    const double s = RateControl(gains, lag).stiffening().x();
    const double k1 = inertia * rate * s, k2 = s - 1, p = k1 * k1;
    const double s12 = lag * k1, s22 = lag * k2, s11 = inertia * (s12 / lag + k1 * k2);  // from the mixed equation
    Eigen::Matrix2d a, cost, q;
    a << 0, 1 / inertia, 0, -1 / lag;
    cost << s11, s12, s12, s22;
    q << p, 0, 0, gains.torque_weight;
    const Eigen::RowVector2d k(k1, k2);
    const Eigen::Matrix2d residual = a.transpose() * cost + cost * a - k.transpose() * k + q;
    EXPECT_LT(residual.norm(), 1e-9 * (1 + q.norm())) << residual;
    EXPECT_GT(s11 * s22 - s12 * s12, 0) << "the stabilising solution is positive definite";
  }
}

TEST(RateControl, AnswersASteadyErrorWithInertiaTimesRate) {
  const Gains gains = example_gains();
  RateControl control(gains, 0.033);
  const Eigen::Matrix3d inertia = Eigen::Vector3d(1e-3, 2e-3, 3e-3).asDiagonal();
  const Eigen::Vector3d feedback(0.1, -0.2, 0.3);
  Eigen::Vector3d torque;
  for (int i = 0; i < 5000; ++i) {
    torque = control.torque({0, 0, 0}, feedback, {0, 0, 0}, inertia);
    control.applied(torque, 0.002);
  }
  EXPECT_LT((torque - inertia * gains.rate.cwiseProduct(feedback)).norm(), 1e-9);
}

TEST(RateControl, CancelsTheGyroscopicTorque) {
  const Eigen::Matrix3d inertia = Eigen::Vector3d(1e-3, 2e-3, 3e-3).asDiagonal();
  const Eigen::Vector3d rates(1, 2, 3);
  const Eigen::Vector3d torque = RateControl(example_gains(), 0.033).torque({0, 0, 0}, rates, rates, inertia);
  EXPECT_LT((torque - rates.cross(inertia * rates)).norm(), 1e-15);
}

}  // namespace
}  // namespace kphi::flight
