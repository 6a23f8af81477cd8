#include "compensation/flight/simulated_vehicle.hpp"

#include <gtest/gtest.h>

#include "compensation/flight/flight.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace simulated_vehicle_test {

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
           // Without the plate's own m r² (0.42 kg, 17.55 mm off the common centre) T would have 2.570 and 5.341.
           {"T", compensation::shape_t(), {0, 17.55}, {2.699, 2.884, 5.471}},
           {"O", compensation::arms_at(180, 180, 165.676, 180), {-0.27, -2.17}, {1.138, 0.965, 1.992}},
       }) {
    const MassProperties found = mass_properties(example_vehicle(), known.arms);
    EXPECT_LT((1e3 * found.cog - known.cog_mm).norm(), 6e-3) << known.shape;
    EXPECT_LT((1e3 * found.inertia.diagonal() - known.inertia).norm(), 4e-3) << known.shape;
    EXPECT_LT((found.inertia * found.inverse_inertia - Eigen::Matrix3d::Identity()).norm(), 1e-12) << known.shape;
    EXPECT_EQ(found.arm_momentum, 0) << known.shape;
  }
}

TEST(MassProperties, OfASquareGivenAsAPolygonAreThoseOfTheSquare) {
  Vehicle vehicle = example_vehicle();
  vehicle.airframe.polygon = compensation::square_as_polygon(Metres(0.045));
  vehicle.airframe.half_side = Metres(0);
  for (const Angles shape : {compensation::shape_x(), compensation::shape_t(), compensation::shape_o()}) {
    const Rotors<double> rates{1.0, -2.0, 3.0, 0.5};
    const MassProperties found = mass_properties(vehicle, shape, rates);
    const MassProperties square = mass_properties(example_vehicle(), shape, rates);
    EXPECT_LT((found.cog - square.cog).norm(), 1e-15);
    EXPECT_LT((found.inertia - square.inertia).norm(), 1e-15);
    EXPECT_NEAR(found.arm_momentum, square.arm_momentum, 1e-15);
  }
}

/// A plate cut off askew: its middle is not the origin, and its axes are not x and y.
TEST(MassProperties, OfAnyConvexPlateAreThoseOfItsManySmallPieces) {
  using compensation::at;
  const compensation::Position corners[] = {at(0.10, 0.02), at(0.03, 0.07), at(-0.08, 0.04), at(-0.02, -0.05)};
  Vehicle vehicle = example_vehicle();
  vehicle.airframe.polygon = compensation::square_as_polygon(Metres(0.045));
  vehicle.airframe.polygon->outline = *compensation::ConvexPolygon::from(corners, 4);
  vehicle.build.hub_mass_kg = 1e-12;
  const MassProperties found = mass_properties(vehicle, vehicle.x);

  std::vector<Eigen::Vector2d> pieces;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (double x = -0.12; x < 0.12; x += 2e-4) {
    for (double y = -0.12; y < 0.12; y += 2e-4) {
      bool inside = true;
      for (std::size_t i = 0; i < 4; ++i) {
        const auto &a = corners[i], &b = corners[(i + 1) % 4];
        inside = inside && (b.x - a.x).value() * (y - a.y.value()) > (b.y - a.y).value() * (x - a.x.value());
      }
      if (inside) middle += pieces.emplace_back(x, y);
    }
  }
  middle /= static_cast<double>(pieces.size());
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const Eigen::Vector2d& piece : pieces) moments += (piece - middle) * (piece - middle).transpose();
  moments *= vehicle.build.mass_kg / static_cast<double>(pieces.size());
  const double tall = vehicle.build.mass_kg * 0.04 * 0.04 / 12;
  EXPECT_LT((found.cog - middle).norm(), 2e-4);
  EXPECT_NEAR(found.inertia(0, 0), moments(1, 1) + tall, 1e-2 * moments(1, 1));
  EXPECT_NEAR(found.inertia(1, 1), moments(0, 0) + tall, 1e-2 * moments(0, 0));
  EXPECT_NEAR(found.inertia(2, 2), moments.trace(), 1e-2 * moments.trace());
  EXPECT_NEAR(found.inertia(0, 1), -moments(0, 1), 1e-2 * moments.trace());
  EXPECT_LT(found.inertia(0, 1), -0.1 * found.inertia(0, 0)) << "askew";
}

TEST(MassProperties, TakeTheBodysInertiaFromTheFileWhereItIsGiven) {
  Vehicle vehicle = example_vehicle();
  vehicle.build.body_inertia = Eigen::Vector3d(1e-3, 2e-3, 2.5e-3);
  const MassProperties told = mass_properties(vehicle, vehicle.x);
  vehicle.build.body_inertia = Eigen::Vector3d(2e-3, 2e-3, 2.5e-3);
  const MassProperties more = mass_properties(vehicle, vehicle.x);
  EXPECT_NEAR(more.inertia(0, 0) - told.inertia(0, 0), 1e-3, 1e-15);
  EXPECT_NEAR((more.inertia - told.inertia).norm(), 1e-3, 1e-15);
  EXPECT_NEAR(told.inertia(2, 2), 2.5e-3 + 4 * 0.045 * 2 * std::pow(0.045 + 0.117 * std::sqrt(0.5), 2), 1e-12);
}

TEST(MassProperties, OfMovingArmsAreThoseOfTheirPointMasses) {
  const Vehicle vehicle = example_vehicle();
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    Angles arms(4), later(4);
    Rotors<double> rates(4);
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

const double kMorphSeconds = example_build().morph_s;

struct ArmMotionFromX : testing::Test {
  const Vehicle vehicle = example_vehicle();
  ArmMotion motion{vehicle.x, kMorphSeconds};
};

TEST_F(ArmMotionFromX, RestsWhereItBegan) {
  EXPECT_FALSE(motion.moving(0));
  EXPECT_EQ(motion.angles(0), vehicle.x);
  EXPECT_EQ(motion.rates(3), Rotors<double>(4));
}

TEST_F(ArmMotionFromX, ArrivesExactlyAfterTheStatedTimeFromRestToRest) {
  motion.begin(vehicle.o, 2.0);
  EXPECT_EQ(motion.angles(2.0), vehicle.x);
  EXPECT_TRUE(motion.moving(2.0 + kMorphSeconds - 1e-9));
  EXPECT_FALSE(motion.moving(2.0 + kMorphSeconds));
  EXPECT_EQ(motion.angles(2.0 + kMorphSeconds), vehicle.o);
  EXPECT_EQ(motion.rates(2.0)[0], 0.0);
  EXPECT_NEAR(motion.rates(2.0 + kMorphSeconds - 1e-6)[0], 0.0, 1e-9);
  EXPECT_NEAR(motion.angles(2.0 + kMorphSeconds / 2)[0].value(), from_degrees(112.5).value(), 1e-12) << "half way";
}

TEST_F(ArmMotionFromX, RatesAreTheDerivativeOfTheAngles) {
  motion.begin(vehicle.o, 0);
  for (double t = 0.1; t < kMorphSeconds; t += 0.1) {
    for (std::size_t i = 0; i < 4; ++i) {
      const double slope = (motion.angles(t + 1e-5)[i] - motion.angles(t - 1e-5)[i]).value() / 2e-5;
      EXPECT_NEAR(motion.rates(t)[i], slope, 1e-6);
      EXPECT_GT(motion.rates(t)[i], 0) << "arms move one way";
    }
  }
}

}  // namespace simulated_vehicle_test
}  // namespace kphi::flight
