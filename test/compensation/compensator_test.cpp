#include "compensation/compensator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "test/compensation/example_vehicle.hpp"
#include "test/compensation/geometry_vectors.hpp"

namespace kphi::compensation {
namespace compensator_test {

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
  Compensator compensator = with_arms(shape_o());
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
    compensator.set_arms(all_at(known.theta_deg));
    for (const Radians phi : compensator.occlusion_angles()) EXPECT_NEAR(to_degrees(phi), known.phi_deg, 0.005);
  }
}

TEST(Compensator, AgreesWithTheKnownAnglesOfRandomVehicles) {
  int built = 0;
  for (const GeometryVector& v : geometry_vectors()) {
    if (!v.arm) continue;
    auto outcome = build_with(paper_line(), example_airframe_of(v.half_side, v.arm_length, v.radius));
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
  expect_plain_map(with_arms(shape_o(), *build_with(example_line(1.0, 0.0)).compensator), 4);
}

TEST(Compensator, UsesEachRotorsOwnLine) {
  const ThrustCurve steep = example_line(1.0, -0.006), flat = example_line(1.0, 0.0);
  const Compensator compensator =
      with_arms(shape_o(), *Compensator::build({flat, steep, flat, flat}, example_airframe()).compensator);
  EXPECT_EQ(compensator.scaling_factors()[0], 1.0);
  EXPECT_NEAR(compensator.scaling_factors()[1], 1 - 0.006 * 64.84, 5e-5);
}

TEST(Compensator, MovingOneArmChangesThatRotorOnly) {
  const Compensator compensator = with_arms(arms_at(45, 45, 180, 45));
  for (const std::size_t i : {0u, 1u, 3u}) EXPECT_EQ(compensator.scaling_factors()[i], 1.0);
  EXPECT_LT(compensator.scaling_factors()[2], 0.85);
}

TEST(Compensator, PublishedLawSpeedsUpBelowTenDegreesWhereTheClampedOneDoesNot) {
  const auto just_touching = all_at(148);  // about 4°
  EXPECT_LT(with_arms(just_touching, example_compensator(ScalingLaw::published)).scaling_factors()[0], 0.99);
  EXPECT_EQ(with_arms(just_touching).scaling_factors()[0], 1.0);
}

TEST(Compensator, HasTheSamePhiWhicheverWayItGotToAShape) {
  const Compensator direct = with_arms(shape_o());
  Compensator wandering = example_compensator();
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> theta(-90, 180);
  for (int i = 0; i < 1000; ++i) {
    wandering.set_arms(arms_at(theta(random), theta(random), theta(random), theta(random)));
  }
  wandering.set_arms(shape_o());
  EXPECT_EQ(direct.occlusion_angles(), wandering.occlusion_angles());
  EXPECT_EQ(direct.scaling_factors(), wandering.scaling_factors());
}

TEST(Compensator, TakesThreeToEightRotorsWithPropellersOfTheirOwn) {
  for (const std::size_t count : {3u, 5u, 6u, 8u}) {
    Airframe airframe = example_airframe();
    airframe.polygon = PolygonBody{regular_polygon(count < 5 ? 3 : 6, 0.07), Rotors<Hinge>(count)};
    airframe.propeller_radii = Rotors<Metres>(count, Metres(0.0635));
    airframe.propeller_radii[1] = Metres(0.05);
    for (std::size_t i = 0; i < count; ++i) {
      const double turn = 2 * kPi * static_cast<double>(i) / static_cast<double>(count);
      airframe.polygon->hinges[i] = {at(0.06 * std::cos(turn), 0.06 * std::sin(turn)), Radians(turn), false};
    }
    const auto built = Compensator::build(Rotors<ThrustCurve>(count, paper_line()), airframe);
    ASSERT_EQ(built.refusal, Refusal::none) << describe(built.refusal);
    Compensator compensator = *built.compensator;
    compensator.set_arms(Rotors<Radians>(count, from_degrees(150)));
    const auto speeds = compensator.speeds_for(Rotors<Newtons>(count, Newtons(1.5))).speeds;
    ASSERT_EQ(speeds.size(), count);
    EXPECT_GT(speeds[count - 1], RadPerSec(500));
    EXPECT_EQ(compensator.occlusion_angles()[1], occlusion_of_arm(airframe, 1, from_degrees(150)));
    EXPECT_NE(compensator.occlusion_angles()[1], compensator.occlusion_angles()[0]) << "another disk";
    const Rotors<ThrustCurve> too_few(count - 1, paper_line());
    EXPECT_EQ(Compensator::build(too_few, airframe).refusal, Refusal::rotors);
    airframe.propeller_radii = Rotors<Metres>(2, Metres(0.05));
    EXPECT_EQ(Compensator::build(Rotors<ThrustCurve>(count, paper_line()), airframe).refusal, Refusal::rotors);
  }
  Airframe airframe = example_airframe();
  airframe.arms.stale = Radians(0);
  EXPECT_EQ(build_with(paper_line(), airframe).refusal, Refusal::arm_limits);
}

TEST(Compensator, TurnsFasterInThinAirByTheRootOfItsDensity) {
  Compensator compensator = with_arms(shape_o());
  const auto thrusts = thrusts_of(1, 1.5, 2, 1);
  const auto before = compensator.speeds_for(thrusts).speeds;
  const auto most = compensator.thrust_max();
  ASSERT_TRUE(compensator.set_air_density_ratio(0.9075));  // standard air at 1000 m
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(compensator.speeds_for(thrusts).speeds[i] / before[i], std::sqrt(1 / 0.9075), 1e-12);
    EXPECT_NEAR(compensator.thrust_max()[i] / most[i], 0.9075, 1e-12);
    EXPECT_NEAR(compensator.uncovered_thrusts(thrusts)[i].value(),
                thrusts[i].value() / compensator.scaling_factors()[i], 1e-12)
        << "the stack's own curve knows its air";
  }
  compensator.set_arms(shape_x());
  EXPECT_NEAR(compensator.speeds_for(thrusts).speeds[1].value(),
              std::sqrt(1.5 / (kExampleCoefficient.value() * 0.9075)), 1e-9)
      << "after a move, too";
  for (const double bad : {0.0, -1.0, 0.1, 10.0, kNaN, kInfinity}) EXPECT_FALSE(compensator.set_air_density_ratio(bad));
  EXPECT_EQ(compensator.air_density_ratio(), 0.9075);
}

TEST(Compensator, GetsNewCoefficientsInFlightWithoutForgettingItsArms) {
  Compensator flies = with_arms(shape_o());
  flies.set_air_density_ratio(0.95);
  const auto thrusts = thrusts_of(1, 1.5, 2, 1);

  Compensator same = example_compensator();
  same.resume_from(flies);
  EXPECT_EQ(same.speeds_for(thrusts).speeds, flies.speeds_for(thrusts).speeds) << "no step where nothing changed";

  Compensator better = build_with(example_line(1.02, -0.0026), example_airframe()).compensator.value();
  better.resume_from(flies);
  EXPECT_EQ(better.occlusion_angles(), flies.occlusion_angles());
  flies = better;
  Compensator expected = build_with(example_line(1.02, -0.0026), example_airframe()).compensator.value();
  expected.set_air_density_ratio(0.95);
  expected.set_arms(shape_o());
  EXPECT_EQ(flies.speeds_for(thrusts).speeds, expected.speeds_for(thrusts).speeds);

  flies.enable(false);
  better.resume_from(flies);
  EXPECT_FALSE(better.enabled());
  better.resume_from(example_compensator());
  EXPECT_TRUE(better.arm_flags()[0].has(Flag::arm_angle_unknown)) << "nobody knows its arms yet";
}

TEST(Compensator, GivesTheThrustOfAKThatChangesWithTheSpeed) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> theta(-10, 185), share(-0.2, 0.2), part(0.01, 0.99);
  for (int i = 0; i < 2000; ++i) {
    ThrustCurve curve = i % 2 == 0 ? paper_line() : example_table();
    const SpeedTrend trend{share(random) / 2000, RadPerSec(1500)};
    ASSERT_TRUE(curve.set_speed_trend(trend));
    Compensator compensator = build_with(curve).compensator.value();
    ASSERT_TRUE(compensator.set_air_density_ratio(0.91));
    compensator.set_arms({from_degrees(theta(random)), from_degrees(theta(random)), from_degrees(theta(random)),
                          from_degrees(theta(random))});
    Rotors<Newtons> asked(4);
    for (std::size_t j = 0; j < 4; ++j) asked[j] = compensator.thrust_max()[j] * part(random);
    const SpeedCommand command = compensator.speeds_for(asked);
    const Rotors<Newtons> uncovered = compensator.uncovered_thrusts(asked);
    for (std::size_t j = 0; j < 4; ++j) {
      const double speed = command.speeds[j].value(), k = 0.91 * kExampleCoefficient.value() * trend.factor_at(speed);
      EXPECT_NEAR(k * compensator.scaling_factors()[j] * speed * speed, asked[j].value(), 1e-7 * asked[j].value());
      EXPECT_NEAR(k * speed * speed, uncovered[j].value(), 1e-7 * uncovered[j].value()) << "of an uncovered propeller";
      EXPECT_FALSE(command.flags[j].has(Flag::speed_at_fastest));
    }
    EXPECT_NEAR(compensator.speeds_for(compensator.thrust_max()).speeds[0] / example_airframe().fastest_speed, 1, 1e-7);
    compensator.enable(false);
    EXPECT_EQ(bits(compensator.speeds_for(Rotors<Newtons>(4, Newtons(2))).speeds[0].value()),
              bits(std::sqrt(2 / (kExampleCoefficient.value() * 0.91))));
  }
}

TEST(Compensator, TellsTheMixerTheMeasuredTorqueOverPhi) {
  ThrustCurve curve = paper_line();
  const Knot shares[] = {{Radians(0), 1}, {from_degrees(90), 0.8}, {from_degrees(270), 0.7}};
  ASSERT_TRUE(curve.set_torque_share(*OcclusionTable::from(shares, 3)));
  Compensator compensator = build_with(curve).compensator.value();
  compensator.set_arms(shape_o());
  for (std::size_t i = 0; i < 4; ++i) {
    const double phi = to_degrees(compensator.occlusion_angles()[i]);
    EXPECT_NEAR(compensator.drag_scale()[i], (1 - 0.2 * phi / 90) / compensator.scaling_factors()[i], 1e-12);
  }
  compensator.enable(false);
  for (const double scale : compensator.drag_scale()) EXPECT_EQ(scale, 1);
}

TEST(Compensator, PromisesNotToThrow) {
  using C = Compensator;
  static_assert(noexcept(std::declval<C&>().set_arms(std::array<Radians, 4>{})));
  static_assert(noexcept(std::declval<C&>().speeds_for(std::array<Newtons, 4>{})));
  static_assert(noexcept(std::declval<C&>().enable(true)));
  static_assert(noexcept(C::build(std::declval<std::array<ThrustCurve, 4>&>(), Airframe{})));
  static_assert(std::is_trivially_copyable_v<C>);
  EXPECT_LE(sizeof(C), 7168u) << "8 curves with two tables of 12 knots are most of it";
}

TEST(CompensatorBody, FliesByAreaAndByLoadWhereTheLineWasFittedSo) {
  struct Known {
    OverlapMeasure measure;
    double phi_deg, phi_of_arm_2_deg;
  };
  for (const Known known :
       {Known{OverlapMeasure::rim_arc, 64.84, 41.29}, Known{OverlapMeasure::area_share, 42.79, 17.66},
        Known{OverlapMeasure::load_share, 50.51, 22.76}}) {
    const Compensator compensator = with_arms(shape_o(), compensator_of(example_airframe(known.measure)));
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
  const Position corners[] = {at(0.10, 0.03),   at(0.0, 0.05),  at(-0.10, 0.03),
                              at(-0.10, -0.03), at(0.0, -0.05), at(0.10, -0.03)};
  Airframe airframe = example_airframe();
  airframe.polygon =
      PolygonBody{*ConvexPolygon::from(corners, 6),
                  {Hinge{corners[0], from_degrees(0), false}, Hinge{corners[2], from_degrees(180), true},
                   Hinge{corners[3], from_degrees(180), false}, Hinge{corners[5], from_degrees(0), true}}};
  Compensator compensator = compensator_of(airframe);
  compensator.set_arms(all_at(45));
  for (const Radians phi : compensator.occlusion_angles()) EXPECT_EQ(phi.value(), 0.0);
  compensator.set_arms(all_at(170));  // folded back over the body's long sides
  for (const Radians phi : compensator.occlusion_angles()) {
    EXPECT_GT(to_degrees(phi), 30.0);
    EXPECT_NEAR(phi.value(), compensator.occlusion_angles()[0].value(), 1e-12) << "the shape is symmetric";
  }
  airframe.polygon->hinges[2].turn = Radians(kNaN);
  EXPECT_EQ(build_with(paper_line(), airframe).refusal, Refusal::hinges);
}

void expect_refused(const Airframe& airframe, Refusal reason) {
  const BuildOutcome outcome = build_with(paper_line(), airframe);
  EXPECT_FALSE(outcome.compensator);
  EXPECT_EQ(outcome.refusal, reason) << describe(outcome.refusal);
}

TEST(CompensatorBuild, IsRefusedForAnAirframeThatCannotBe) {
  for (const double bad : {kNaN, kInfinity, 0.0, -0.1}) {
    for (Metres Airframe::*size : {&Airframe::half_side, &Airframe::arm_length, &Airframe::propeller_radius}) {
      Airframe airframe = example_airframe();
      airframe.*size = Metres(bad);
      expect_refused(airframe, Refusal::sizes);
    }
    Airframe airframe = example_airframe();
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
  EXPECT_TRUE(build_with(area, airframe).compensator);
}

TEST(CompensatorBuild, DoubtsALineThatStepsAtContactOrGainsWithOcclusion) {
  const auto doubts = doubts_about;
  EXPECT_FALSE(doubts(paper_line(), ScalingLaw::clamped).steps_at_contact);
  EXPECT_TRUE(doubts(paper_line(), ScalingLaw::published).steps_at_contact);
  EXPECT_TRUE(doubts(example_line(0.95, -0.002), ScalingLaw::clamped).steps_at_contact);
  EXPECT_FALSE(doubts(example_line(1.0 - 1e-12, -0.002), ScalingLaw::published).steps_at_contact);
  EXPECT_FALSE(doubts(paper_line(), ScalingLaw::clamped).gains_with_occlusion);
  EXPECT_TRUE(doubts(example_line(1.0, 0), ScalingLaw::clamped).gains_with_occlusion);
}

class Hubs : public testing::TestWithParam<OverlapMeasure> {};

TEST_P(Hubs, AreTheSameAsArmsThatHaveThemThere) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> angle(-kPi / 2, kPi);
  Airframe square = example_airframe(GetParam()), polygon = square;
  polygon.polygon = square_as_polygon(square.half_side);
  const Masses masses{0.42, {}, {0.045, 0.05, 0.045, 0.04}};
  const Rotors<int> spins{1, -1, 1, -1};
  for (const Airframe& airframe : {square, polygon}) {
    Compensator by_arms = compensator_of(airframe), by_hubs = by_arms;
    for (int i = 0; i < 10'000; ++i) {
      const Rotors<Radians> arms{Radians(angle(random)), Radians(angle(random)), Radians(angle(random)),
                                 Radians(angle(random))};
      Rotors<HubPosition> hubs(4);
      for (std::size_t j = 0; j < 4; ++j) hubs[j] = hub_in_body(airframe, j, arms[j]);
      by_arms.set_arms(arms);
      by_hubs.set_hubs(hubs);
      const RotorLayout a = by_arms.layout(masses, spins), b = by_hubs.layout(masses, spins);
      for (std::size_t j = 0; j < 4; ++j) {
        // The rim's arc is a root at tangency: there a place to 1e-17 m is an angle to 1e-8.
        const bool touches = by_arms.occlusion_angles()[j].value() < 1e-3;
        ASSERT_NEAR(by_hubs.occlusion_angles()[j].value(), by_arms.occlusion_angles()[j].value(),
                    touches ? 1e-7 : 1e-12);
        ASSERT_NEAR(b.hubs[j].x.value(), a.hubs[j].x.value(), 1e-15);
        ASSERT_NEAR(b.hubs[j].y.value(), a.hubs[j].y.value(), 1e-15);
      }
    }
  }
}
INSTANTIATE_TEST_SUITE_P(EachMeasure, Hubs,
                         testing::Values(OverlapMeasure::rim_arc, OverlapMeasure::area_share,
                                         OverlapMeasure::load_share));

TEST(Hubs, OfATelescopingArmUncoverItsPropeller) {
  Compensator compensator = example_compensator();
  compensator.set_arms(shape_o());
  const double folded = compensator.occlusion_angles()[0].value();
  Rotors<HubPosition> hubs(4, at(0.3, 0.3));
  hubs[0] = at(-0.072 - 0.02, 0.045);  // 2 cm longer than in O
  compensator.set_hubs(hubs);
  EXPECT_GT(compensator.occlusion_angles()[0].value(), 0.1);
  EXPECT_LT(compensator.occlusion_angles()[0].value(), folded);
  EXPECT_EQ(compensator.occlusion_angles()[1].value(), 0);

  // What is no place keeps the last, with a flag; so does the one that resumes.
  const double before = compensator.occlusion_angles()[0].value();
  hubs[0] = {Metres(kNaN), Metres(0)};
  hubs[1] = at(1e5, 0);
  compensator.set_hubs(hubs, {Seconds(0.01), {0, 0, 1, 0}});
  EXPECT_TRUE(compensator.arm_flags()[0].has(Flag::arm_angle_unknown));
  EXPECT_TRUE(compensator.arm_flags()[1].has(Flag::arm_angle_beyond));
  EXPECT_TRUE(compensator.arm_flags()[2].has(Flag::arm_angle_stale)) << "1 cm";
  EXPECT_FALSE(compensator.arm_flags()[3].any());
  EXPECT_EQ(compensator.occlusion_angles()[0].value(), before);
  Compensator next = example_compensator();
  next.resume_from(compensator);
  EXPECT_EQ(next.occlusion_angles()[0].value(), before);
  compensator.set_arms(shape_o());
  EXPECT_EQ(compensator.occlusion_angles()[0].value(), folded) << "arms again";
}

TEST(Bodies, OfSeveralPartsCoverByTheirSum) {
  const auto box = [](double x, double y, double half) {
    const Position corners[] = {at(x + half, y + half), at(x - half, y + half), at(x - half, y - half),
                                at(x + half, y - half)};
    return *ConvexPolygon::from(corners, 4);
  };
  Airframe two = example_airframe(OverlapMeasure::area_share), left = two, right = two;
  left.polygon = PolygonBody{box(-0.1, 0, 0.05), Rotors<Hinge>(4)};
  right.polygon = PolygonBody{box(0.1, 0, 0.05), Rotors<Hinge>(4)};
  two.polygon = left.polygon;
  two.polygon->more[1] = box(0.1, 0, 0.05);
  Compensator both = compensator_of(two), one = compensator_of(left), other = compensator_of(right);
  const Rotors<HubPosition> hubs{at(0, 0), at(0.02, 0.01), at(-0.1, 0.08), at(0.3, 0)};
  for (Compensator* each : {&both, &one, &other}) each->set_hubs(hubs);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(both.occlusion_angles()[i].value(), (one.occlusion_angles()[i] + other.occlusion_angles()[i]).value(),
                1e-14);
  }
  EXPECT_GT(one.occlusion_angles()[0].value(), 0.1);
  EXPECT_GT(other.occlusion_angles()[0].value(), 0.1);
  two.polygon->more[0] = box(-0.05, 0.04, 0.02);
  EXPECT_EQ(build_with(paper_line(two.overlap), two).refusal, Refusal::body);
  two.polygon->more[0] = box(-0.02, 0, 0.03);
  EXPECT_EQ(build_with(paper_line(two.overlap), two).refusal, Refusal::none) << "they meet at an edge";

  // Where a hinge stands free of the body an arm may be short.
  two.arm_length = Metres(0.03);
  EXPECT_EQ(build_with(paper_line(two.overlap), two).refusal, Refusal::none);
}

TEST(CompensatorUncertainty, TellsTheUncertaintyOfItsSpeeds) {
  const ThrustCurve rim = paper_line();
  const double k = kExampleCoefficient.value();
  const ThrustCurve line = *paper_line_if(OverlapMeasure::rim_arc, LineUncertainty{0.01 * k, 0.0004 * k * k, 0, 0});
  const Rotors<ThrustCurve> curves{line, line, line, rim};
  Compensator compensator = *Compensator::build(curves, example_airframe()).compensator;
  const auto thrusts = thrusts_of(1.5, 1.5, 1.5, 1.5);
  compensator.set_arms(arms_at(45, 180, 180, 180));
  const auto speeds = compensator.speeds_for(thrusts).speeds;
  const auto exact_arms = compensator.speed_uncertainties(curves, thrusts);
  EXPECT_NEAR(exact_arms[0] / speeds[0], 0.005, 1e-12) << "half of K_T's";
  EXPECT_NEAR(exact_arms[1] / speeds[1], 0.5 * 0.02 / compensator.scaling_factors()[1], 1e-12) << "half of the line's";
  EXPECT_EQ(exact_arms[3].value(), kInfinity) << "the line carries none";

  // A degree of servo play moves φ by 1.5 to 1.84 degrees in O.
  const auto loose_arms = compensator.speed_uncertainties(curves, thrusts, from_degrees(1));
  const double from_phi = std::sqrt(std::pow(loose_arms[1] / speeds[1], 2) - std::pow(exact_arms[1] / speeds[1], 2));
  EXPECT_NEAR(2 * from_phi * compensator.scaling_factors()[1] / 0.0028889, 1.7, 0.2);
  EXPECT_EQ(loose_arms[0], exact_arms[0]) << "far from contact the arm does not matter";

  compensator.enable(false);
  const auto off = compensator.speed_uncertainties(curves, thrusts, from_degrees(1));
  EXPECT_NEAR(off[1] / compensator.speeds_for(thrusts).speeds[1], 0.005, 1e-12);
  compensator.enable(true);
  compensator.set_arms(arms_at(45, std::nan(""), 180, 180));
  EXPECT_EQ(compensator.speed_uncertainties(curves, thrusts)[1].value(), kInfinity) << "the arm is anywhere";
  for (const RadPerSec none : compensator.speed_uncertainties(curves, thrusts, Radians(kNaN))) {
    EXPECT_EQ(none.value(), kInfinity);
  }
}

}  // namespace compensator_test
}  // namespace kphi::compensation
