#include "compensation/flight/pilot.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/flight.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace pilot_test {

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

Pilot example_pilot() { return *Pilot::build(example_vehicle(), four(bench_line()), example_settings()); }

/// Of a body that stands on its reference.
RotorSpeeds speeds_on_reference(Pilot& pilot) {
  pilot.look(Reference(), {{0, 0, kHeight}, {0, 0, 0}}, kLevel);
  return pilot.act({0, 0, 0});
}

TEST(Pilot, CarriesTheWeightInEveryShape) {
  Pilot pilot = example_pilot();
  for (const Angles shape :
       {compensation::shape_x(), compensation::shape_h(), compensation::shape_t(), compensation::shape_o()}) {
    pilot.set_arms(shape);
    (void)speeds_on_reference(pilot);
    double sum = 0;
    for (const Newtons thrust : pilot.thrusts()) sum += thrust.value();
    EXPECT_NEAR(sum, 0.60 * kGravity, 1e-9);
  }
  EXPECT_EQ(pilot.concessions(), 0);
}

TEST(Pilot, TurnsCoveredRotorsFasterOnlyWhenItCompensates) {
  Pilot pilot = example_pilot();
  const auto speeds_in = [&](const Angles& shape, bool on) {
    pilot.set_arms(shape);
    pilot.compensate(on);
    return speeds_on_reference(pilot);
  };
  for (const Angles open : {compensation::shape_x(), compensation::shape_h(), compensation::shape_t()}) {
    EXPECT_EQ(speeds_in(open, true), speeds_in(open, false)) << "nothing is covered in X, H and T: bit for bit";
  }
  EXPECT_GT(speeds_in(compensation::shape_o(), true).sum(), 1.05 * speeds_in(compensation::shape_o(), false).sum());
}

/// A rotor's torque follows its squared speed, not the thrust that is left of it: covered rotors turn the body more.
TEST(Pilot, HoldsYawStillInOBecauseItAllocatesWithTheTorqueOfCoveredRotors) {
  Pilot pilot = example_pilot();
  pilot.set_arms(compensation::shape_o());
  const double k_t = bench_line().thrust_coefficient().value();
  for (const bool on : {true, false}) {
    pilot.compensate(on);
    const RotorSpeeds squares = speeds_on_reference(pilot).cwiseAbs2();
    const Build build = example_build();
    double yaw = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      yaw += build.spin[i] * build.yaw_arm_m * k_t * squares[static_cast<Eigen::Index>(i)];
    }
    EXPECT_NEAR(yaw, 0, 1e-9) << "N m, compensated: " << on;
  }
}

TEST(Pilot, KeepsEveryRotorWithinWhatItCanGiveWhateverIsDemanded) {
  Pilot pilot = example_pilot();
  Random random(12);
  const double fastest = example_vehicle().airframe.fastest_speed.value();
  for (int i = 0; i < 3000; ++i) {
    Angles arms(4);
    for (Radians& arm : arms) arm = Radians(random.uniform(-1.5, 3.1));
    pilot.set_arms(arms);
    pilot.compensate(random.uniform(0, 1) > 0.5);
    const Eigen::Quaterniond attitude(Eigen::AngleAxisd(
        random.uniform(-3, 3), Eigen::Vector3d(random.normal(0, 1), random.normal(0, 1), 1).normalized()));
    const auto anywhere = [&] {
      return Eigen::Vector3d(random.normal(0, 2), random.normal(0, 2), random.normal(0, 2));
    };
    pilot.look(Reference(), {anywhere(), anywhere()}, attitude);
    const RotorSpeeds speeds = pilot.act(10 * anywhere());
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_GE(pilot.thrusts()[j].value(), 0);
      ASSERT_LE(pilot.thrusts()[j].value(), pilot.compensator().thrust_max()[j].value() * (1 + 1e-12));
      ASSERT_GE(speeds[static_cast<Eigen::Index>(j)], 0);
      ASSERT_LE(speeds[static_cast<Eigen::Index>(j)], fastest);
    }
  }
  EXPECT_GT(pilot.concessions(), 100) << "the demands were wild enough to saturate";
}

TEST(Pilot, IsRefusedForAVehicleThatCannotFly) {
  Vehicle vehicle = example_vehicle();
  vehicle.airframe.arm_length = Metres(0.01);
  EXPECT_FALSE(Pilot::build(vehicle, four(bench_line()), example_settings()));
}

}  // namespace pilot_test
}  // namespace kphi::flight
