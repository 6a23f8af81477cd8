#include "compensation/compensator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/geometry_vectors.hpp"
#include "test/compensation/line_of.hpp"

namespace kphi::compensation {
namespace compensator_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

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

TEST(CompensatorBody, FliesByAreaAndByLoadWhereTheLineWasFittedSo) {
  struct Known {
    OverlapMeasure measure;
    double phi_deg, phi_of_arm_2_deg;
  };
  for (const Known known :
       {Known{OverlapMeasure::rim_arc, 64.84, 41.29}, Known{OverlapMeasure::area_share, 42.79, 17.66},
        Known{OverlapMeasure::load_share, 50.51, 22.76}}) {
    Compensator compensator = compensator_of(example_airframe(known.measure));
    compensator.set_arms(shape_o());
    EXPECT_NEAR(to_degrees(compensator.occlusion_angles()[0]), known.phi_deg, 0.01);
    EXPECT_NEAR(to_degrees(compensator.occlusion_angles()[2]), known.phi_of_arm_2_deg, 0.01);
  }
}

TEST(CompensatorBody, FindsTheSamePhiOnASquareGivenAsAPolygon) {
  Airframe airframe = example_airframe();
  airframe.polygon = square_as_polygon(Metres(0.045));
  airframe.half_side = Metres(0);
  Compensator general = compensator_of(airframe);
  Compensator closed = example_compensator();
  std::mt19937_64 random(77);
  std::uniform_real_distribution<double> theta(-90, 180);
  for (int i = 0; i < 20000; ++i) {
    const auto arms = arms_at(theta(random), theta(random), theta(random), theta(random));
    general.set_arms(arms);
    closed.set_arms(arms);
    for (std::size_t j = 0; j < 4; ++j) {
      ASSERT_NEAR(general.occlusion_angles()[j].value(), closed.occlusion_angles()[j].value(), 1e-7);
      const HubPosition hub = hub_in_body(airframe, j, arms[j]), same = hub_in_body(example_airframe(), j, arms[j]);
      ASSERT_NEAR(hub.x.value(), same.x.value(), 1e-15);
      ASSERT_NEAR(hub.y.value(), same.y.value(), 1e-15);
    }
  }
}

TEST(CompensatorBody, KnowsBodiesAndHingesOfAnyConvexShape) {
  // A long hexagon, arms hinged at its four outer corners, those of the left side mirrored.
  const Position corners[] = {{Metres(0.10), Metres(0.03)},  {Metres(0.0), Metres(0.05)},
                              {Metres(-0.10), Metres(0.03)}, {Metres(-0.10), Metres(-0.03)},
                              {Metres(0.0), Metres(-0.05)},  {Metres(0.10), Metres(-0.03)}};
  Airframe airframe = example_airframe();
  airframe.polygon = PolygonBody{*ConvexPolygon::from(corners, 6),
                                 {{{corners[0], from_degrees(0), false},
                                   {corners[2], from_degrees(180), true},
                                   {corners[3], from_degrees(180), false},
                                   {corners[5], from_degrees(0), true}}}};
  Compensator compensator = compensator_of(airframe);
  compensator.set_arms(arms_at(45, 45, 45, 45));
  for (const Radians phi : compensator.occlusion_angles()) EXPECT_EQ(phi.value(), 0.0);
  compensator.set_arms(arms_at(170, 170, 170, 170));  // folded back over the body's long sides
  for (const Radians phi : compensator.occlusion_angles()) {
    EXPECT_GT(to_degrees(phi), 30.0);
    EXPECT_NEAR(phi.value(), compensator.occlusion_angles()[0].value(), 1e-12) << "the shape is symmetric";
  }
  airframe.polygon->hinges[2].turn = Radians(kNaN);
  const ThrustCurve line = paper_line();
  EXPECT_EQ(Compensator::build({line, line, line, line}, airframe).refusal, Refusal::hinges);
}

TEST(CompensatorFlags, HoldsTheSpeedLimitsAndSaysSo) {
  Airframe airframe = example_airframe();
  airframe.slowest_speed = from_rpm(1000);
  const ThrustCurve line = paper_line();
  const Compensator compensator = *Compensator::build({line, line, line, line}, airframe).compensator;
  const SpeedCommand command = compensator.speeds_for(thrusts_of(0.0, 100.0, 1.5, kInfinity));
  EXPECT_EQ(command.speeds[0], from_rpm(1000));
  EXPECT_TRUE(command.flags[0].has(Flag::speed_at_slowest));
  EXPECT_EQ(command.speeds[1], from_rpm(19100));
  EXPECT_TRUE(command.flags[1].has(Flag::speed_at_fastest));
  EXPECT_FALSE(command.flags[2].any());
  EXPECT_EQ(command.speeds[3], from_rpm(19100));
}

TEST(CompensatorFlags, CountsAThrustThatIsNaNOrNegativeAsZeroAndSaysSo) {
  const SpeedCommand command = example_compensator().speeds_for(thrusts_of(kNaN, -1.0, -kInfinity, 2.0));
  for (const std::size_t i : {0u, 1u, 2u}) EXPECT_EQ(command.speeds[i].value(), 0.0);
  EXPECT_TRUE(command.flags[0].has(Flag::thrust_nan));
  EXPECT_TRUE(command.flags[1].has(Flag::thrust_negative));
  EXPECT_TRUE(command.flags[2].has(Flag::thrust_negative));
  EXPECT_FALSE(command.flags[3].any());
}

TEST(CompensatorFlags, KeepsTheLastOcclusionWhileAnArmAngleIsUnknown) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  const double before = compensator.scaling_factors()[1];
  for (const double unknown : {kNaN, kInfinity, -kInfinity}) {
    auto arms = shape_o();
    arms[1] = Radians(unknown);
    compensator.set_arms(arms);
    EXPECT_EQ(compensator.scaling_factors()[1], before);
    const SpeedCommand command = compensator.speeds_for(thrusts_of(1, 1, 1, 1));
    EXPECT_TRUE(command.flags[1].has(Flag::arm_angle_unknown));
    EXPECT_FALSE(command.flags[0].any());
  }
  compensator.set_arms(shape_o());
  EXPECT_FALSE(compensator.arm_flags()[1].any()) << "the angle that was known before is known again";
}

TEST(CompensatorFlags, EnablingKeepsTheFlagOfAnUnknownArm) {
  Compensator compensator = example_compensator();
  auto arms = shape_o();
  arms[3] = Radians(kNaN);
  compensator.set_arms(arms);
  compensator.enable(false);
  compensator.enable(true);
  EXPECT_TRUE(compensator.arm_flags()[3].has(Flag::arm_angle_unknown));
}

TEST(CompensatorFlags, SaysWhenTheOcclusionLiesBeyondTheFit) {
  const ThrustCurve narrow = example_line(1.03, -0.0028889, 60), wide = example_line(1.03, -0.0028889, 65);
  Compensator compensator = *Compensator::build({narrow, wide, narrow, wide}, example_airframe()).compensator;
  compensator.set_arms(shape_o());
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::beyond_fit));
  EXPECT_FALSE(compensator.arm_flags()[1].any());
  EXPECT_FALSE(compensator.arm_flags()[2].any());  // 41°
}

TEST(CompensatorFlags, SaysWhenTheScalingFactorIsAtItsFloor) {
  const ThrustCurve collapsing = example_line(1.0, -0.02);
  Compensator compensator =
      *Compensator::build({collapsing, collapsing, collapsing, collapsing}, example_airframe()).compensator;
  compensator.set_arms(shape_o());
  EXPECT_EQ(compensator.scaling_factors()[0], kScalingFloor);
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::at_floor));
  EXPECT_FALSE(compensator.arm_flags()[2].has(Flag::at_floor));
}

TEST(CompensatorFlags, PublishedLawBeyondZeroSpinsAtTheFastestSpeedNotAtNaN) {
  const ThrustCurve collapsing = example_line(1.0, -0.02);  // k < 0 beyond 50°
  Compensator compensator =
      *Compensator::build({collapsing, collapsing, collapsing, collapsing}, example_airframe(), ScalingLaw::published)
           .compensator;
  compensator.set_arms(shape_o());
  ASSERT_LT(compensator.scaling_factors()[0], 0.0);
  const SpeedCommand command = compensator.speeds_for(thrusts_of(1.0, 0.0, 1.0, 1e-9));
  EXPECT_EQ(command.speeds[0], from_rpm(19100));
  EXPECT_TRUE(command.flags[0].has(Flag::speed_at_fastest));
  EXPECT_EQ(command.speeds[1].value(), 0.0);
  EXPECT_GE(compensator.thrust_max()[0].value(), 0.0);
  EXPECT_EQ(compensator.drag_scale()[0], 1 / kScalingFloor);
}

TEST(CompensatorFlags, SaysWhenTheLineLiesAboveKtAndTheFactorIsHeldAtOne) {
  Compensator clamped = example_compensator(), published = example_compensator(ScalingLaw::published);
  for (Compensator* compensator : {&clamped, &published}) compensator->set_arms(arms_at(148, 45, 180, 45));  // about 4°
  EXPECT_TRUE(clamped.arm_flags()[0].has(Flag::at_ceiling));
  EXPECT_FALSE(clamped.arm_flags()[1].any());
  EXPECT_FALSE(clamped.arm_flags()[2].any());
  EXPECT_FALSE(published.arm_flags()[0].any()) << "equation 4 to the letter holds nothing";
}

TEST(CompensatorFlags, LetsNoNaNOutWhateverGoesIn) {
  std::mt19937_64 random(99);
  const double odd[] = {kNaN, kInfinity, -kInfinity, 1e308, -1e308, 5e-324, 0.0, -0.0, 1.5, 3.0, kPi, -1.2, 100.0};
  std::uniform_int_distribution<std::size_t> pick(0, std::size(odd) - 1);
  const auto four = [&] {
    return std::array<double, 4>{odd[pick(random)], odd[pick(random)], odd[pick(random)], odd[pick(random)]};
  };
  for (const ScalingLaw law : {ScalingLaw::clamped, ScalingLaw::published}) {
    Compensator compensator = example_compensator(law);
    for (int i = 0; i < 50000; ++i) {
      const auto theta = four(), thrust = four();
      compensator.set_arms({Radians(theta[0]), Radians(theta[1]), Radians(theta[2]), Radians(theta[3])});
      const SpeedCommand command = compensator.speeds_for(thrusts_of(thrust[0], thrust[1], thrust[2], thrust[3]));
      for (std::size_t j = 0; j < 4; ++j) {
        ASSERT_GE(command.speeds[j].value(), 0.0);
        ASSERT_LE(command.speeds[j], from_rpm(19100));
        ASSERT_GE(compensator.occlusion_angles()[j].value(), 0.0);
        ASSERT_LE(compensator.occlusion_angles()[j].value(), 2 * kPi);
        ASSERT_GE(compensator.thrust_max()[j].value(), 0.0);
        ASSERT_GE(compensator.drag_scale()[j], 1.0);
        ASSERT_LE(compensator.drag_scale()[j], 1 / kScalingFloor);
      }
    }
  }
}

void expect_refused(const Airframe& airframe, Refusal reason) {
  const ThrustCurve line = paper_line();
  const BuildOutcome outcome = Compensator::build({line, line, line, line}, airframe);
  EXPECT_FALSE(outcome.compensator);
  EXPECT_EQ(outcome.refusal, reason) << describe(outcome.refusal);
}

TEST(CompensatorBuild, IsRefusedForAnAirframeThatCannotBe) {
  for (const double bad : {kNaN, kInfinity, 0.0, -0.1}) {
    Airframe airframe = example_airframe();
    airframe.half_side = Metres(bad);
    expect_refused(airframe, Refusal::sizes);
    airframe = example_airframe();
    airframe.arm_length = Metres(bad);
    expect_refused(airframe, Refusal::sizes);
    airframe = example_airframe();
    airframe.propeller_radius = Metres(bad);
    expect_refused(airframe, Refusal::sizes);
    airframe = example_airframe();
    airframe.fastest_speed = RadPerSec(bad);
    expect_refused(airframe, Refusal::speeds);
  }
  Airframe airframe = example_airframe();
  airframe.arm_length = airframe.propeller_radius;
  expect_refused(airframe, Refusal::arm_length);
  for (const double bad : {kNaN, -1.0, 1e6}) {
    airframe = example_airframe();
    airframe.slowest_speed = RadPerSec(bad);
    expect_refused(airframe, Refusal::speeds);
  }
  for (const int bad : {-1, 0, 2, 4, 33}) {  // arms 0 and 2 are at corners 0 and 2 already
    airframe = example_airframe();
    airframe.hinge_turns[1] = bad;
    expect_refused(airframe, Refusal::hinge_turns);
  }
}

TEST(CompensatorBuild, IsRefusedWhereALineWasFittedWithAnotherMeasure) {
  const ThrustCurve rim = paper_line(), area = paper_line(OverlapMeasure::area_share);
  Airframe airframe = example_airframe();
  EXPECT_EQ(Compensator::build({rim, rim, area, rim}, airframe).refusal, Refusal::overlap);
  airframe.overlap = OverlapMeasure::area_share;
  EXPECT_EQ(Compensator::build({area, area, rim, area}, airframe).refusal, Refusal::overlap);
  EXPECT_TRUE(Compensator::build({area, area, area, area}, airframe).compensator);
}

TEST(CompensatorBuild, DoubtsALineThatStepsAtContactOrGainsWithOcclusion) {
  const auto doubts = [](const ThrustCurve& line, ScalingLaw law) {
    return Compensator::build({line, line, line, line}, example_airframe(), law).doubts[0];
  };
  EXPECT_FALSE(doubts(paper_line(), ScalingLaw::clamped).steps_at_contact);
  EXPECT_TRUE(doubts(paper_line(), ScalingLaw::published).steps_at_contact);
  EXPECT_TRUE(doubts(example_line(0.95, -0.002), ScalingLaw::clamped).steps_at_contact);
  EXPECT_FALSE(doubts(example_line(1.0 - 1e-12, -0.002), ScalingLaw::published).steps_at_contact);
  EXPECT_FALSE(doubts(paper_line(), ScalingLaw::clamped).gains_with_occlusion);
  EXPECT_TRUE(doubts(example_line(1.0, 0), ScalingLaw::clamped).gains_with_occlusion);
}

TEST(CompensatorUncertainty, TellsTheUncertaintyOfItsSpeeds) {
  const ThrustCurve rim = paper_line();
  const double k = kExampleCoefficient.value();
  const LineUncertainty u{0.01 * k, 0.0004 * k * k, 0, 0};
  const ThrustCurve line =
      *ThrustCurve::from_line(rim.thrust_coefficient(), line_of(rim).intercept, line_of(rim).slope_per_rad,
                              rim.largest_fitted(), OverlapMeasure::rim_arc, u);
  Compensator compensator = *Compensator::build({line, line, line, rim}, example_airframe()).compensator;
  const auto thrusts = thrusts_of(1.5, 1.5, 1.5, 1.5);
  compensator.set_arms(arms_at(45, 180, 180, 180));
  const auto speeds = compensator.speeds_for(thrusts).speeds;
  const auto exact_arms = compensator.speed_uncertainties(thrusts);
  EXPECT_NEAR(exact_arms[0] / speeds[0], 0.005, 1e-12) << "half of K_T's";
  EXPECT_NEAR(exact_arms[1] / speeds[1], 0.5 * 0.02 / compensator.scaling_factors()[1], 1e-12) << "half of the line's";
  EXPECT_EQ(exact_arms[3].value(), kInfinity) << "the line carries none";

  // A degree of servo play moves φ by 1.5 to 1.84 degrees in O.
  const auto loose_arms = compensator.speed_uncertainties(thrusts, from_degrees(1));
  const double from_phi = std::sqrt(std::pow(loose_arms[1] / speeds[1], 2) - std::pow(exact_arms[1] / speeds[1], 2));
  EXPECT_NEAR(2 * from_phi * compensator.scaling_factors()[1] / 0.0028889, 1.7, 0.2);
  EXPECT_EQ(loose_arms[0], exact_arms[0]) << "far from contact the arm does not matter";

  compensator.enable(false);
  const auto off = compensator.speed_uncertainties(thrusts, from_degrees(1));
  EXPECT_NEAR(off[1] / compensator.speeds_for(thrusts).speeds[1], 0.005, 1e-12);
  compensator.enable(true);
  compensator.set_arms(arms_at(45, std::nan(""), 180, 180));
  EXPECT_EQ(compensator.speed_uncertainties(thrusts)[1].value(), kInfinity) << "the arm is anywhere";
  for (const RadPerSec none : compensator.speed_uncertainties(thrusts, Radians(kNaN))) {
    EXPECT_EQ(none.value(), kInfinity);
  }
}

}  // namespace compensator_test
}  // namespace kphi::compensation
