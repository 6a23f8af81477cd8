#include "compensation/compensator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/geometry_vectors.hpp"

namespace kphi::compensation {
namespace {

std::uint64_t bits(double value) {
  std::uint64_t result;
  std::memcpy(&result, &value, sizeof result);
  return result;
}

void expect_plain_map(const Compensator& compensator, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> thrust(0.0, 6.0);
  for (int i = 0; i < 10000; ++i) {
    const auto asked = thrusts_of(thrust(random), thrust(random), thrust(random), thrust(random));
    const SpeedCommand command = compensator.speeds_for(asked);
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_EQ(bits(command.speeds[j].value()), bits(std::sqrt(asked[j].value() / kExampleCoefficient.value())));
      ASSERT_FALSE(command.flags[j].any());
    }
  }
}

TEST(Compensator, FindsTheOcclusionsAndFactorsOfO) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  const double phi[] = {64.84, 64.84, 41.29, 64.84};
  const double k[] = {.84269, .84269, .91071, .84269};
  const double thrust_max[] = {5.226, 5.226, 5.648, 5.226};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(to_degrees(compensator.occlusion_angles()[i]), phi[i], 0.005);
    EXPECT_NEAR(compensator.scaling_factors()[i], k[i], 1e-5);
    EXPECT_NEAR(compensator.thrust_max()[i].value(), thrust_max[i], 5e-4);
    EXPECT_DOUBLE_EQ(compensator.drag_scale()[i], 1 / compensator.scaling_factors()[i]);
  }
}

TEST(Compensator, FollowsTheArmFromFirstContactToO) {
  Compensator compensator = example_compensator();
  struct Known {
    double theta_deg, phi_deg;
  };
  for (const Known known : {Known{147.47, 0.0}, Known{150, 12.62}, Known{160, 32.63}, Known{165, 40.27},
                            Known{170, 47.94}, Known{175, 56.04}, Known{180, 64.84}}) {
    compensator.set_arms(arms_at(known.theta_deg, known.theta_deg, known.theta_deg, known.theta_deg));
    for (const Radians phi : compensator.occlusion_angles()) EXPECT_NEAR(to_degrees(phi), known.phi_deg, 0.005);
  }
}

TEST(Compensator, AgreesWithTheKnownAnglesOfRandomVehicles) {
  const auto vectors = geometry_vectors();
  int built = 0;
  for (const GeometryVector& v : vectors) {
    if (!v.arm) continue;
    Airframe airframe = example_airframe();
    airframe.half_side = Metres(v.half_side);
    airframe.arm_length = Metres(v.arm_length);
    airframe.propeller_radius = Metres(v.radius);
    const ThrustCurve line = paper_line();
    auto outcome = Compensator::build({line, line, line, line}, airframe);
    if (v.arm_length <= v.radius) {
      EXPECT_EQ(outcome.refusal, Refusal::arm_length);
      continue;
    }
    ASSERT_TRUE(outcome.compensator);
    ++built;
    outcome.compensator->set_arms({Radians(v.theta), Radians(v.theta), Radians(v.theta), Radians(v.theta)});
    for (const Radians phi : outcome.compensator->occlusion_angles()) EXPECT_NEAR(phi.value(), v.phi_arc, 1e-12);
  }
  EXPECT_GT(built, 50);
}

TEST(Compensator, RaisesTheSpeedByTheRootOfTheScalingFactor) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  const SpeedCommand command = compensator.speeds_for(thrusts_of(1.5, 1.5, 1.5, 1.5));
  const double plain = std::sqrt(1.5 / kExampleCoefficient.value());
  EXPECT_NEAR(command.speeds[0].value() / plain, 1 / std::sqrt(.84269), 1e-5);
  EXPECT_NEAR(command.speeds[2].value() / plain, 1 / std::sqrt(.91071), 1e-5);
}

TEST(Compensator, ReturnsTheThrustItWasAskedFor) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> thrust(1e-6, 5.2);
  for (int i = 0; i < 10000; ++i) {
    const auto asked = thrusts_of(thrust(random), thrust(random), thrust(random), thrust(random));
    const SpeedCommand command = compensator.speeds_for(asked);
    for (std::size_t j = 0; j < 4; ++j) {
      const ThrustCoefficient k = kExampleCoefficient * compensator.scaling_factors()[j];
      EXPECT_NEAR(thrust_at(k, command.speeds[j]) / asked[j], 1.0, 1e-12);
    }
  }
}

TEST(Compensator, LeavesTheMapUntouchedBitForBitWhereNothingIsCovered) {
  for (const ScalingLaw law : {ScalingLaw::clamped, ScalingLaw::published}) {
    Compensator compensator = example_compensator(law);
    expect_plain_map(compensator, 1);  // before the first arm angle
    for (const auto& shape : {shape_x(), shape_h(), shape_t()}) {
      compensator.set_arms(shape_o());
      compensator.set_arms(shape);
      expect_plain_map(compensator, 2);
      for (const double k : compensator.scaling_factors()) EXPECT_EQ(k, 1.0);
      for (const double scale : compensator.drag_scale()) EXPECT_EQ(scale, 1.0);
    }
  }
}

TEST(Compensator, SwitchedOffIsThePlainMapBitForBitAndKeepsFollowingTheArms) {
  Compensator compensator = example_compensator();
  compensator.enable(false);
  compensator.set_arms(shape_o());
  EXPECT_FALSE(compensator.enabled());
  expect_plain_map(compensator, 3);
  EXPECT_NEAR(to_degrees(compensator.occlusion_angles()[0]), 64.84, 0.005);
  EXPECT_NEAR(compensator.thrust_max()[0].value(), 6.202, 5e-4);

  compensator.enable(true);
  EXPECT_NEAR(compensator.scaling_factors()[0], .84269, 1e-5);
}

TEST(Compensator, WithALineThatIsAlwaysKtIsThePlainMapInO) {
  const ThrustCurve flat = example_line(1.0, 0.0);
  Compensator compensator = *Compensator::build({flat, flat, flat, flat}, example_airframe()).compensator;
  compensator.set_arms(shape_o());
  expect_plain_map(compensator, 4);
}

TEST(Compensator, UsesEachRotorsOwnLine) {
  const ThrustCurve steep = example_line(1.0, -0.006), flat = example_line(1.0, 0.0);
  Compensator compensator = *Compensator::build({flat, steep, flat, flat}, example_airframe()).compensator;
  compensator.set_arms(shape_o());
  EXPECT_EQ(compensator.scaling_factors()[0], 1.0);
  EXPECT_NEAR(compensator.scaling_factors()[1], 1 - 0.006 * 64.84, 5e-5);
}

TEST(Compensator, MovingOneArmChangesThatRotorOnly) {
  Compensator compensator = example_compensator();
  compensator.set_arms(arms_at(45, 45, 180, 45));
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(compensator.scaling_factors()[i], 1.0);
  EXPECT_LT(compensator.scaling_factors()[2], 0.85);
}

TEST(Compensator, SpeedGrowsWithThrust) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  double last = -1;
  for (double thrust = 0; thrust < 7; thrust += 0.001) {
    const double speed = compensator.speeds_for(thrusts_of(thrust, 0, 0, 0)).speeds[0].value();
    EXPECT_GE(speed, last);
    last = speed;
  }
}

TEST(Compensator, PublishedLawSpeedsUpBelowTenDegreesWhereTheClampedOneDoesNot) {
  Compensator published = example_compensator(ScalingLaw::published), clamped = example_compensator();
  const auto just_touching = arms_at(148, 148, 148, 148);  // about 4°
  published.set_arms(just_touching);
  clamped.set_arms(just_touching);
  EXPECT_LT(published.scaling_factors()[0], 0.99);
  EXPECT_EQ(clamped.scaling_factors()[0], 1.0);
}

TEST(Compensator, HasTheSamePhiWhicheverWayItGotToAShape) {
  Compensator direct = example_compensator(), wandering = example_compensator();
  direct.set_arms(shape_o());
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> theta(-90, 180);
  for (int i = 0; i < 1000; ++i) {
    wandering.set_arms(arms_at(theta(random), theta(random), theta(random), theta(random)));
  }
  wandering.set_arms(shape_o());
  EXPECT_EQ(direct.occlusion_angles(), wandering.occlusion_angles());
  EXPECT_EQ(direct.scaling_factors(), wandering.scaling_factors());
}

TEST(Compensator, PromisesNotToThrow) {
  using C = Compensator;
  static_assert(noexcept(std::declval<C&>().set_arms(std::array<Radians, 4>{})));
  static_assert(noexcept(std::declval<C&>().speeds_for(std::array<Newtons, 4>{})));
  static_assert(noexcept(std::declval<C&>().enable(true)));
  static_assert(noexcept(C::build(std::declval<std::array<ThrustCurve, 4>&>(), Airframe{})));
  static_assert(std::is_trivially_copyable_v<C>);
  EXPECT_LE(sizeof(C), 1664u);
}

}  // namespace
}  // namespace kphi::compensation
