#include "compensation/flight/aircraft.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/flight.hpp"
#include "compensation/flight/simulated_vehicle.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace aircraft_test {

const double kMorphSeconds = example_build().morph_s;

constexpr double kWidth = 0.002;

const double kThrustCoefficient = bench_line().thrust_coefficient().value();

struct World {
  explicit World(const Truth& with) : truth(with) {}

  /// A drone that begins level and carries itself, `steps` later.
  [[nodiscard]] AircraftState hovered(const Eigen::Vector3d& from, int steps) const {
    const double hover = std::sqrt(kGravity * x.mass.mass_kg / 4 / kThrustCoefficient);
    AircraftState state = level_state({from, {0, 0, 0}}, x.mass, hover);
    for (int i = 0; i < steps; ++i) {
      state = plant.step(state, kWidth, {&x, &x, &x}, speeds_of(hover, hover, hover, hover));
    }
    return state;
  }

  const Vehicle vehicle = example_vehicle();
  const Truth truth;
  const Aircraft plant{vehicle, truth, example_shadow()};
  const Configuration x = plant.configuration(vehicle.x, {});
};

class InCleanAir : public testing::Test, public World {
 protected:
  InCleanAir() : World(clean_scene().truth) {}
};

Eigen::Vector3d momentum_in_world(const AircraftState& state) { return state.attitude() * state.momentum(); }

double spin_energy(const AircraftState& state, const MassProperties& mass) {
  return 0.5 * state.momentum().dot(body_rates(state, mass));
}

AircraftState tumbling(const Configuration& configuration, Random& random) {
  AircraftState state = level_state({{0, 0, 0}, {1, 2, 3}}, configuration.mass, 0);
  for (Eigen::Index i = 0; i < 3; ++i) state.momentum()[i] += random.normal(0, 0.02);
  return state;
}

TEST_F(InCleanAir, KeepsMomentumAndEnergyOfABodyThatNothingTouches) {
  Random random(4);
  for (const Angles& shape : {vehicle.x, vehicle.o, Angles(compensation::shape_t())}) {
    const Configuration still = plant.configuration(shape, {});
    AircraftState state = tumbling(still, random);
    const Eigen::Vector3d momentum = momentum_in_world(state);
    const double energy = spin_energy(state, still.mass);
    for (int i = 0; i < 2500; ++i) {
      state = plant.step(state, kWidth, {&still, &still, &still}, RotorSpeeds::Zero());
      ASSERT_NEAR(state.y.segment<4>(6).norm(), 1, 1e-15);
    }
    EXPECT_LT((momentum_in_world(state) - momentum).norm(), 1e-6 * momentum.norm());
    EXPECT_NEAR(spin_energy(state, still.mass), energy, 1e-6 * energy);
    const double t = 2500 * kWidth;
    const Eigen::Vector3d start(still.mass.cog.x(), still.mass.cog.y(), 0);
    EXPECT_LT((state.position() - start - Eigen::Vector3d(t, 2 * t, 3 * t - kGravity / 2 * t * t)).norm(), 1e-9)
        << "the centre of gravity falls on a parabola";
  }
}

TEST_F(InCleanAir, KeepsMomentumWhileTheArmsFoldAndTurnsTheBodyAgainstThem) {
  ArmMotion motion(vehicle.x, kMorphSeconds);
  motion.begin(vehicle.o, 0);
  const auto at = [&](double t) { return plant.configuration(motion.angles(t), motion.rates(t)); };
  Configuration now = at(0);
  AircraftState state = level_state({{0, 0, 0}, {0, 0, 0}}, now.mass, 0);
  const auto body = [&] { return body_motion(state, now.mass); };
  const double height = body().position.z();
  double slowest = 0;
  for (int i = 0; i * kWidth < kMorphSeconds; ++i) {
    const Configuration middle = at((i + 0.5) * kWidth), end = at((i + 1) * kWidth);
    state = plant.step(state, kWidth, {&now, &middle, &end}, RotorSpeeds::Zero());
    now = end;
    slowest = std::min(slowest, body_rates(state, now.mass).z());
    ASSERT_LT(momentum_in_world(state).norm(), 1e-12);
    // Nothing pushes sideways: the centre of gravity stays where it was, so the body moves the other way.
    ASSERT_LT(state.position().head<2>().norm(), 1e-12);
  }
  EXPECT_LT(slowest, -0.5) << "rad/s";
  EXPECT_LT(body().position.head<2>().norm(), 0.01);
  EXPECT_GT(body().position.head<2>().norm(), 0.001) << "the centre of gravity lies elsewhere in O";
  EXPECT_LT(body().position.z(), height);
}

TEST_F(InCleanAir, BodyMotionIsTheDerivativeOfTheBodysPosition) {
  ArmMotion motion(compensation::shape_t(), kMorphSeconds);
  motion.begin(vehicle.o, 0);
  const double t = 0.6, width = 1e-4;
  const auto at = [&](double time) { return plant.configuration(motion.angles(time), motion.rates(time)); };
  const Configuration now = at(t), middle = at(t + width / 2), end = at(t + width);
  Random random(8);
  const AircraftState state = tumbling(now, random);
  const AircraftState next = plant.step(state, width, {&now, &middle, &end}, RotorSpeeds::Zero());
  const Eigen::Vector3d slope = (body_motion(next, end.mass).position - body_motion(state, now.mass).position) / width;
  const Eigen::Vector3d mean = (body_motion(next, end.mass).velocity + body_motion(state, now.mass).velocity) / 2;
  EXPECT_LT((slope - mean).norm(), 1e-6);
}

Truth with_drag(double drag, const Eigen::Vector3d& wind) {
  Truth truth = clean_scene().truth;
  truth.drag = drag;
  truth.wind = wind;
  return truth;
}

TEST(Aircraft, HoversWhenTheRotorsCarryItsWeight) {
  const Eigen::Vector3d start(0, 0, 1);
  EXPECT_LT((World(with_drag(0.3, {0, 0, 0})).hovered(start, 1000).position() - start).norm(), 1e-9);
}

TEST_F(InCleanAir, RotorsFollowTheirCommandWithTheirTimeConstant) {
  AircraftState state = level_state({{0, 0, 0}, {0, 0, 0}}, x.mass, 100);
  const int steps = 33;  // 66 ms, two time constants
  for (int i = 0; i < steps; ++i) {
    state = plant.step(state, kWidth, {&x, &x, &x}, speeds_of(1100, 1100, 1100, 1100));
  }
  EXPECT_NEAR(state.rotors()[2], 1100 - 1000 * std::exp(-2.0), 1e-3);
}

TEST_F(InCleanAir, TorquesPointTheWayTheRotorsPush) {
  AircraftState state = level_state({{0, 0, 0}, {0, 0, 0}}, x.mass, 0);
  state.rotors()[0] = 1000;  // front left: lifts the nose (pitch down is positive y) and the left side
  const AircraftState::Vector slope = plant.slope(state.y, x, state.rotors());
  const double thrust = kThrustCoefficient * 1e6;
  EXPECT_NEAR(slope[10], x.mass.hubs[0].y() * thrust, 1e-12);
  EXPECT_NEAR(slope[11], -x.mass.hubs[0].x() * thrust, 1e-12);
  EXPECT_NEAR(slope[12], 0.0133 * thrust, 1e-12);
  EXPECT_NEAR(slope[5], thrust / x.mass.mass_kg - kGravity, 1e-12);
}

TEST_F(InCleanAir, LosesThrustButNoTorqueOverTheBody) {
  const Configuration o = plant.configuration(vehicle.o, {});
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(x.thrust_per_square[i], kThrustCoefficient);
    const double share = thrust_share_in_flight(truth.law, truth.gamma, example_shadow(), i, vehicle.o[i]);
    EXPECT_EQ(o.thrust_per_square[i], kThrustCoefficient * share);
    EXPECT_EQ(o.torque_per_square[i], x.torque_per_square[i]);
  }
  EXPECT_GT(o.thrust_per_square[2], 1.02 * o.thrust_per_square[1]) << "arm 3 stops short";
}

TEST(Aircraft, DriftsWithTheWind) {
  const Eigen::Vector3d wind(1, -2, 0);
  const double reached = 1 - std::exp(-0.5 * 1000 * kWidth);
  EXPECT_LT((World(with_drag(0.5, wind)).hovered({0, 0, 0}, 1000).velocity() - reached * wind).norm(), 1e-9);
}

/// 1.2 s of tumbling with rotors running up and arms folding, in `steps` steps.
AircraftState tumble(int steps) {
  const Vehicle vehicle = example_vehicle();
  const Aircraft plant(vehicle, Truth(), example_shadow());
  Angles nearly = vehicle.x;  // stays away from the body: the occlusion's onset is no smooth function
  for (Radians& arm : nearly) arm = from_degrees(120);
  ArmMotion motion(vehicle.x, kMorphSeconds);
  motion.begin(nearly, 0);
  const auto at = [&](double t) { return plant.configuration(motion.angles(t), motion.rates(t)); };
  AircraftState state = level_state({{0, 0, 1}, {0.3, 0, 0}}, at(0).mass, 500);
  state.momentum() += Eigen::Vector3d(4e-3, -2e-3, 3e-3);
  const double width = 1.2 / steps;
  for (int i = 0; i < steps; ++i) {
    const Configuration begin = at(i * width), middle = at((i + 0.5) * width), end = at((i + 1) * width);
    state = plant.step(state, width, {&begin, &middle, &end}, speeds_of(1000, 900, 1100, 950));
  }
  return state;
}

TEST(RungeKutta, ConvergesWithTheFourthPowerOfTheStep) {
  const AircraftState exact = tumble(9600);
  double last = 0;
  for (const int steps : {75, 150, 300}) {
    const double error = (tumble(steps).y - exact.y).head<13>().norm();
    if (last > 0) {
      EXPECT_NEAR(std::log2(last / error), 4.0, 0.35) << steps << " steps: " << error;
    }
    last = error;
  }
}

TEST(RungeKutta, ErrsByLittleAtTheStepThatFlies) {
  EXPECT_LT((tumble(600).y - tumble(9600).y).head<13>().norm(), 1e-7);
}

}  // namespace aircraft_test
}  // namespace kphi::flight
