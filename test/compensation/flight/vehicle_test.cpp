#include "compensation/flight/vehicle.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/arm_motion.hpp"
#include "compensation/flight/random.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace {

struct Known {
  const char* shape;
  Angles arms;
  Eigen::Vector2d cog_mm;
  Eigen::Vector3d inertia;  // 1e-3 kg m²
};

TEST(MassProperties, OfTheFourShapesAreThoseComputedByHand) {
  for (const Known& known : std::vector<Known>{
           {"X", compensation::shape_x(), {0, 0}, {3.276, 3.276, 6.441}},
           {"H", compensation::shape_h(), {0, 0}, {0.704, 5.063, 5.655}},
           {"T", compensation::shape_t(), {0, 17.55}, {2.699, 2.884, 5.471}},
           {"O", compensation::arms_at(180, 180, 165.676, 180), {-0.27, -2.17}, {1.138, 0.965, 1.992}},
       }) {
    const MassProperties found = mass_properties(example_vehicle(), known.arms, {});
    EXPECT_LT((1e3 * found.cog - known.cog_mm).norm(), 6e-3) << known.shape;
    EXPECT_LT((1e3 * found.inertia.diagonal() - known.inertia).norm(), 4e-3) << known.shape;
    EXPECT_LT((found.inertia * found.inverse_inertia - Eigen::Matrix3d::Identity()).norm(), 1e-12) << known.shape;
    EXPECT_EQ(found.arm_momentum, 0) << known.shape;
  }
}

TEST(MassProperties, OfMovingArmsAreThoseOfTheirPointMasses) {
  const Vehicle vehicle = example_vehicle();
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    Angles arms, later;
    std::array<double, 4> rates{};
    const double width = 1e-6;
    for (std::size_t j = 0; j < 4; ++j) {
      arms[j] = Radians(random.uniform(-1.5, 3.1));
      rates[j] = random.uniform(-4, 4);
      later[j] = arms[j] + Radians(width * rates[j]);
    }
    const MassProperties now = mass_properties(vehicle, arms, rates), next = mass_properties(vehicle, later, rates);
    EXPECT_LT((now.cog_rate - (next.cog - now.cog) / width).norm(), 1e-5);
    double momentum = 0;
    const double plate = vehicle.build.mass_kg - 4 * vehicle.build.hub_mass_kg;
    const auto add = [&](double mass, const Eigen::Vector2d& at, const Eigen::Vector2d& speed) {
      const Eigen::Vector2d r = at - now.cog, v = speed - now.cog_rate;
      momentum += mass * (r.x() * v.y() - r.y() * v.x());
    };
    add(plate, {0, 0}, {0, 0});
    for (std::size_t j = 0; j < 4; ++j) {
      add(vehicle.build.hub_mass_kg, now.hubs[j], (next.hubs[j] - now.hubs[j]) / width);
    }
    EXPECT_NEAR(now.arm_momentum, momentum, 1e-6);
  }
}

TEST(MassProperties, PutTheCentreOfGravityWhereTheOffsetPlatePutsIt) {
  const Vehicle vehicle = example_vehicle();
  const double plate = 1 - 4 * vehicle.build.hub_mass_kg / vehicle.build.mass_kg;
  const MassProperties found = mass_properties(vehicle, vehicle.x, {}, Eigen::Vector2d(1e-3, -2e-3) / plate);
  EXPECT_LT((found.cog - Eigen::Vector2d(1e-3, -2e-3)).norm(), 1e-12);
}

}  // namespace
}  // namespace kphi::flight
