#include "compensation/flight/flight.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/study.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace flight_test {

FlightResult flown(ExperimentIndex index, const Scene& scene, std::vector<TraceRow>* trace = nullptr) {
  return fly(kExperiments[index], scene, example_shadow(), trace);
}

Eigen::Vector3d hover_error(ExperimentIndex index, const Scene& scene) {
  return flown(index, scene).legs[1].mean_error;
}

/// e_z = (g/kpz)(1/η̄ − 1), η̄ the mean thrust share weighted with the thrusts asked for; independent of the masses.
TEST(Hover, SinksByWhatTheLostThrustAsksOfTheProportionalGain) {
  const Scene scene = clean_scene();
  double given = 0, asked = 0;
  Pilot pilot = *Pilot::build(scene.vehicle, scene.curves, scene.pilot);
  pilot.set_arms(scene.vehicle.o);
  pilot.compensate(false);
  pilot.look(Reference(), {{0, 0, kHeight}, {0, 0, 0}}, Eigen::Quaterniond::Identity());
  (void)pilot.act({0, 0, 0});
  for (std::size_t i = 0; i < 4; ++i) {
    const double thrust = pilot.thrusts()[i].value();
    asked += thrust;
    given +=
        thrust * thrust_share_in_flight(scene.truth.law, scene.truth.gamma, example_shadow(), i, scene.vehicle.o[i]);
  }
  const double expected = kGravity / 15 * (asked / given - 1);
  EXPECT_GT(expected, 0.12);
  EXPECT_NEAR(hover_error(kHoverPlain, scene).z(), expected, 0.03 * expected);
}

TEST(Hover, IsExactInXWhenTheControllerKnowsEverything) {
  const FlightResult flight = flown(kHoverPlain, clean_scene());
  EXPECT_LT(flight.legs[0].mean_error.norm(), 1e-6);
  EXPECT_LT(flight.legs[2].mean_error.norm(), 1e-3) << "and again after O";
  EXPECT_EQ(flight.concessions, 0);
}

TEST(Hover, IsBetterWithCompensationAndTheSameInX) {
  const FlightResult plain = flown(kHoverPlain, example_scene()), helped = flown(kHoverCompensated, example_scene());
  EXPECT_LT(std::fabs(helped.legs[1].mean_error.z()), 0.4 * plain.legs[1].mean_error.z());
  EXPECT_EQ(helped.legs[0].mean_error, plain.legs[0].mean_error) << "nothing is covered in X: bit for bit";
}

TEST(Hover, TakesNoMorePowerWithCompensation) {
  const FlightResult flight = flown(kHoverSwitched, example_scene());
  const double with = flight.legs[0].mean_square_speed, without = flight.legs[1].mean_square_speed;
  EXPECT_NEAR(with / without, 1, 0.02);
  EXPECT_GT(without, 1.1 * flown(kHoverPlain, example_scene()).legs[0].mean_square_speed) << "but O takes more than X";
}

TEST(Control, OfALineWithoutSlopeChangesNothingAtAll) {
  Scene scene = example_scene();
  scene.curves = four(scaled_loss(scene.curves[0], 0));
  std::vector<TraceRow> plain, helped;
  (void)flown(kHoverPlain, scene, &plain);
  (void)flown(kHoverCompensated, scene, &helped);
  ASSERT_EQ(plain.size(), helped.size());
  for (std::size_t i = 0; i < plain.size(); ++i) {
    ASSERT_EQ(plain[i].truth, helped[i].truth) << plain[i].time;
    ASSERT_EQ(plain[i].speeds, helped[i].speeds) << plain[i].time;
  }
}

TEST(Control, OfALineWithTwiceTheSlopeOvershoots) {
  Scene scene = example_scene();
  EXPECT_GT(hover_error(kHoverCompensated, scene).z(), 0) << "below: more is lost in flight than on the bench";
  scene.curves = four(scaled_loss(scene.curves[0], 2));
  EXPECT_LT(hover_error(kHoverCompensated, scene).z(), -0.03) << "above its reference";
}

/// Arm 3 is covered less than the others. Whichever rotor is taken for it instead, the drone is pushed aside.
TEST(Control, OfArmsTakenForOneAnotherIsWorseSideways) {
  Scene scene = clean_scene();
  const double right = hover_error(kHoverCompensated, scene).head<2>().norm();
  for (const Rotors<std::size_t>& order : std::vector<Rotors<std::size_t>>{{1, 2, 3, 0}, {2, 3, 0, 1}, {3, 0, 1, 2}}) {
    scene.pilot.arm_order = order;
    EXPECT_GT(hover_error(kHoverCompensated, scene).head<2>().norm(), 1.2 * right)
        << order[0] << order[1] << order[2] << order[3];
  }
}

TEST(Flight, LeavesATraceOfEveryTickOfEveryLeg) {
  std::vector<TraceRow> trace;
  (void)flown(kLevelSwitched, example_scene(), &trace);
  const double seconds = 2 * leg_seconds(Path::level_circle);
  EXPECT_NEAR(static_cast<double>(trace.size()), seconds / 0.01, 2);
  EXPECT_EQ(trace.front().time, 0);
  EXPECT_NEAR(trace.back().time, seconds, 0.02);
  EXPECT_EQ(trace.back().leg, 1u);
  EXPECT_NEAR(to_degrees(Radians(trace.front().occlusions[0])), 64.837, 0.01);
  EXPECT_EQ(trace.front().scaling[0], 1) << "not compensated";
  EXPECT_LT(trace.back().scaling[0], 0.9);
}

TEST(Flight, OfADroneThatCannotCarryItselfIsLostAndSaysInWhichLeg) {
  Scene scene = example_scene();
  scene.truth.gamma = 6;
  const FlightResult flight = flown(kHoverPlain, scene);
  EXPECT_TRUE(flight.lost);
  EXPECT_EQ(flight.lost_leg, 1u) << "in O";
  EXPECT_GT(flight.legs[0].mean_square_speed, 0) << "X was flown";
}

TEST(Flight, RefusesAVehicleThatNoControllerCanBeBuiltFor) {
  Scene scene = example_scene();
  scene.vehicle.airframe.propeller_radius = Metres(-1);
  EXPECT_THROW((void)flown(kHoverPlain, scene), std::invalid_argument);
}

TEST(Flight, NoiseOfTheMotorsScattersItAndADelayOfTheGyroLosesAStiffController) {
  const auto scatter = [](double noise) {
    Scene scene = clean_scene();
    scene.truth.motor_noise = noise;
    return fly(kExperiments[kHoverCompensated], scene, example_shadow()).legs[1].deviation;
  };
  const double some = scatter(0.02);
  EXPECT_GT(some, 2 * scatter(0));
  EXPECT_NEAR(scatter(0.04) / some, 2, 0.4) << "twice the noise, twice the scatter";
  const auto stiff_is_lost = [](double delay) {
    Scene scene = clean_scene();
    scene.pilot.gains.rate.head<2>() *= 4;
    scene.truth.gyro_delay_s = delay;
    return fly(kExperiments[kHoverCompensated], scene, example_shadow()).lost;
  };
  EXPECT_FALSE(stiff_is_lost(0));
  EXPECT_FALSE(stiff_is_lost(0.006));
  EXPECT_TRUE(stiff_is_lost(kLongestGyroDelay));
}

}  // namespace flight_test
}  // namespace kphi::flight
