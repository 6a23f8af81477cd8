#include "compensation/flight/runge_kutta.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/arm_motion.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

const double kMorphSeconds = example_build().morph_s;

/// 1.2 s of tumbling with rotors running up and arms folding, in `steps` steps.
PlantState tumble(int steps) {
  const Vehicle vehicle = example_vehicle();
  const Plant plant(vehicle, Truth(), bench_line().thrust_coefficient(), example_shadow());
  Angles nearly = vehicle.x;  // stays away from the body: the occlusion's onset is no smooth function
  for (Radians& arm : nearly) arm = from_degrees(120);
  ArmMotion motion(vehicle.x, kMorphSeconds);
  motion.begin(nearly, 0);
  const auto at = [&](double t) { return plant.configuration(motion.angles(t), motion.rates(t)); };
  PlantState state = level_state({{0, 0, 1}, {0.3, 0, 0}}, at(0).mass, 500);
  state.momentum() += Eigen::Vector3d(4e-3, -2e-3, 3e-3);
  const double width = 1.2 / steps;
  for (int i = 0; i < steps; ++i) {
    const Configuration begin = at(i * width), middle = at((i + 0.5) * width), end = at((i + 1) * width);
    state = plant.step(state, width, {&begin, &middle, &end}, Eigen::Vector4d(1000, 900, 1100, 950));
  }
  return state;
}

TEST(RungeKutta, ConvergesWithTheFourthPowerOfTheStep) {
  const PlantState exact = tumble(9600);
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

}  // namespace
}  // namespace kphi::flight
