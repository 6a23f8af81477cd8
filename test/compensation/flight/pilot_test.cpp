#include "compensation/flight/pilot.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/noise.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

Pilot example_pilot(const PilotSettings& settings = example_settings()) {
  return *Pilot::build(example_vehicle(), bench_line(), settings);
}

const BodyMotion kOnReference{{0, 0, kHeight}, {0, 0, 0}};

TEST(Pilot, CarriesTheWeightInEveryShape) {
  Pilot pilot = example_pilot();
  for (const Angles& shape :
       {compensation::shape_x(), compensation::shape_h(), compensation::shape_t(), compensation::shape_o()}) {
    pilot.set_arms(shape);
    pilot.look(Reference(), kOnReference, Eigen::Quaterniond::Identity());
    (void)pilot.act({0, 0, 0});
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
    pilot.look(Reference(), kOnReference, Eigen::Quaterniond::Identity());
    return pilot.act({0, 0, 0});
  };
  for (const Angles& open : {compensation::shape_x(), compensation::shape_h(), compensation::shape_t()}) {
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
    pilot.look(Reference(), kOnReference, Eigen::Quaterniond::Identity());
    const Eigen::Vector4d squares = pilot.act({0, 0, 0}).cwiseAbs2();
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
    Angles arms;
    for (Radians& arm : arms) arm = Radians(random.uniform(-1.5, 3.1));
    pilot.set_arms(arms);
    pilot.compensate(random.uniform(0, 1) > 0.5);
    const Eigen::Quaterniond attitude(Eigen::AngleAxisd(
        random.uniform(-3, 3), Eigen::Vector3d(random.normal(0, 1), random.normal(0, 1), 1).normalized()));
    const auto anywhere = [&] {
      return Eigen::Vector3d(random.normal(0, 2), random.normal(0, 2), random.normal(0, 2));
    };
    pilot.look(Reference(), {anywhere(), anywhere()}, attitude);
    const Eigen::Vector4d speeds = pilot.act(10 * anywhere());
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
  EXPECT_FALSE(Pilot::build(vehicle, bench_line(), example_settings()));
}

}  // namespace
}  // namespace kphi::flight
