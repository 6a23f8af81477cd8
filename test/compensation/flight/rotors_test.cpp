// Simulated vehicles with six and eight rotors, and with hubs that are on no hinged arm.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "compensation/flight/tables.hpp"
#include "compensation/flight/verdict.hpp"
#include "test/compensation/flight/flight_fixture.hpp"

namespace kphi::flight {
namespace rotors_test {

using compensation::at;
using compensation::Hinge;
using compensation::HubPosition;

Rotors<compensation::ThrustCurve> curves_of(const Vehicle& vehicle) {
  return Rotors<compensation::ThrustCurve>(vehicle.rotors(), bench_line());
}

/// A regular body with an arm hinged at each corner, straight out in X, along the next edge in O. Neighbours turn
/// unlike.
Vehicle star(std::size_t arms, double circumradius) {
  Vehicle vehicle = example_vehicle();
  const double corner = 2 * kPi / static_cast<double>(arms), out = kPi / 2 - corner / 2;
  compensation::PolygonBody body{compensation::regular_polygon(arms, circumradius), Rotors<Hinge>(arms)};
  vehicle.build.spin = Rotors<int>(arms);
  for (std::size_t i = 0; i < arms; ++i) {
    body.hinges[i] = {body.outline.corner(i), Radians(corner * static_cast<double>(i) - out), false};
    vehicle.build.spin[i] = i % 2 == 0 ? 1 : -1;
  }
  vehicle.airframe.polygon = body;
  vehicle.airframe.half_side = Metres(0);
  vehicle.airframe.arm_length = Metres(2 * circumradius * std::sin(corner / 2) + 0.05);
  vehicle.x = Angles(arms, Radians(out));
  vehicle.o = Angles(arms, Radians(kPi));
  vehicle.build.mass_kg = 0.15 * static_cast<double>(arms);
  return vehicle;
}

/// The same hubs, told by themselves.
Vehicle without_hinges(const Vehicle& vehicle) {
  Vehicle told = vehicle;
  told.ways.resize(vehicle.rotors());
  for (std::size_t i = 0; i < vehicle.rotors(); ++i)
    told.ways[i] = {hub_of(vehicle, i, vehicle.x[i]), hub_of(vehicle, i, vehicle.o[i])};
  told.x = Angles(vehicle.rotors(), Radians(0));
  told.o = Angles(vehicle.rotors(), Radians(1));
  told.airframe.polygon->hinges = Rotors<Hinge>(vehicle.rotors());  // means nothing
  return told;
}

Scene clean_scene_of(const Vehicle& vehicle) {
  Scene scene = clean_scene();
  scene.vehicle = vehicle;
  scene.curves = curves_of(vehicle);
  scene.truth.thrust = Rotors<double>(vehicle.rotors(), 1);
  return scene;
}

TEST(MassProperties, OfManyArmsAreThoseOfTheirPointMassesAndTheBody) {
  for (const std::size_t arms : {5u, 6u, 8u}) {
    const Vehicle vehicle = star(arms, 0.1);
    Random random(arms);
    Angles angles(arms);
    for (Radians& angle : angles) angle = Radians(random.uniform(0, kPi));
    const MassProperties found = mass_properties(vehicle, angles);
    Eigen::Vector2d cog = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < arms; ++i) {
      const HubPosition hub = hub_in_body(vehicle.airframe, i, angles[i]);
      cog += 0.045 / vehicle.build.mass_kg * Eigen::Vector2d(hub.x.value(), hub.y.value());
    }
    EXPECT_LT((found.cog - cog).norm(), 1e-12);
    Vehicle bare = vehicle;
    bare.build.hub_mass_kg = 0;
    bare.build.mass_kg -= 0.045 * static_cast<double>(arms);
    double about_z = mass_properties(bare, angles).inertia(2, 2) - vehicle.build.mass_kg * cog.squaredNorm();
    for (std::size_t i = 0; i < arms; ++i) about_z += 0.045 * found.hubs[i].squaredNorm();
    EXPECT_NEAR(found.inertia(2, 2), about_z, 1e-12);
  }
}

TEST(MassProperties, OfHubsOnTheirWayAreThoseOfTheSameHubsAndMoveAsTheyDo) {
  const Vehicle arms = star(6, 0.1), hubs = without_hinges(arms);
  for (const auto& [by_angle, by_way] : {std::pair{arms.x, hubs.x}, std::pair{arms.o, hubs.o}})
    EXPECT_LT((mass_properties(arms, by_angle).inertia - mass_properties(hubs, by_way).inertia).norm(), 1e-15);
  const Rotors<double> rates{0.5, 0.1, 0.0, -0.2, 1.0, 0.3};
  Angles now(6, Radians(0.3)), later = now;
  for (std::size_t i = 0; i < 6; ++i) later[i] = now[i] + 1e-6 * Radians(rates[i]);
  const MassProperties found = mass_properties(hubs, now, rates);
  EXPECT_LT((found.cog_rate - (mass_properties(hubs, later).cog - found.cog) / 1e-6).norm(), 1e-8);
  EXPECT_NE(found.arm_momentum, 0);
}

/// A hexagon cut in two along y = 0, in whole and by its halves.
TEST(MassProperties, AndTheShadowOfABodyOfTwoPartsAreThoseOfTheWhole) {
  const Vehicle whole = star(6, 0.1);
  Vehicle parts = whole;
  const auto& outline = whole.airframe.polygon->outline;
  const compensation::Position upper[] = {outline.corner(0), outline.corner(1), outline.corner(2), outline.corner(3)},
                               lower[] = {outline.corner(3), outline.corner(4), outline.corner(5), outline.corner(0)};
  parts.airframe.polygon->outline = *compensation::ConvexPolygon::from(upper, 4);
  parts.airframe.polygon->more[0] = compensation::ConvexPolygon::from(lower, 4);
  EXPECT_LT((mass_properties(whole, whole.o).inertia - mass_properties(parts, whole.o).inertia).norm(), 1e-15);
  EXPECT_LT((mass_properties(whole, whole.o).cog - mass_properties(parts, whole.o).cog).norm(), 1e-15);
  const Shadow one(whole), two(parts);
  for (std::size_t arm = 0; arm < 6; ++arm) {
    EXPECT_GT(one.arc(arm, Radians(3)), 0.5);
    EXPECT_NEAR(one.arc(arm, Radians(3)), two.arc(arm, Radians(3)), 1e-9);
    EXPECT_NEAR(one.load(arm, Radians(3)), two.load(arm, Radians(3)), 1e-9);
  }
  const FlightResult in_one = fly(kExperiments[kHoverCompensated], clean_scene_of(whole), one);
  const FlightResult in_two = fly(kExperiments[kHoverCompensated], clean_scene_of(parts), two);
  EXPECT_LT((in_one.legs[1].mean_error - in_two.legs[1].mean_error).norm(), 1e-6);
}

TEST(Pilot, OfSixAndEightRotorsCarriesTheWeightWithoutTurning) {
  for (const Vehicle& vehicle : {star(6, 0.1), star(8, 0.12), without_hinges(star(6, 0.1))}) {
    Pilot pilot = *Pilot::build(vehicle, curves_of(vehicle), example_settings());
    for (const Angles& shape : {vehicle.x, vehicle.o}) {
      pilot.set_arms(shape);
      pilot.look(Reference(), {{0, 0, kHeight}, {0, 0, 0}}, Eigen::Quaterniond::Identity());
      const RotorSpeeds speeds = pilot.act({0, 0, 0});
      double lift = 0, yaw = 0;
      for (std::size_t i = 0; i < vehicle.rotors(); ++i) {
        lift += pilot.thrusts()[i].value();
        yaw += vehicle.build.spin[i] * std::pow(speeds[static_cast<Eigen::Index>(i)], 2);
      }
      EXPECT_NEAR(lift, vehicle.build.mass_kg * kGravity, 1e-9);
      EXPECT_NEAR(yaw / speeds.squaredNorm(), 0, 1e-9);
      EXPECT_EQ(speeds.tail(kMostRotors - static_cast<int>(vehicle.rotors())).norm(), 0)
          << "no rotor that is not there";
      EXPECT_GT(speeds.head(static_cast<Eigen::Index>(vehicle.rotors())).minCoeff(), 0);
    }
    EXPECT_EQ(pilot.concessions(), 0);
  }
}

TEST(Pilot, IsRefusedWhereTheRotorsCannotMakeEveryTorque) {
  Vehicle alike = star(6, 0.1), in_line = without_hinges(star(6, 0.1));
  alike.build.spin = Rotors<int>(6, 1);
  for (std::size_t i = 0; i < 6; ++i) in_line.ways[i].to = at(0.1 * static_cast<double>(i), 0);
  EXPECT_FALSE(Pilot::build(alike, curves_of(alike), example_settings()));
  EXPECT_FALSE(Pilot::build(in_line, curves_of(in_line), example_settings()));
}

TEST(Flight, OfSixAndEightRotorsHoversNearerWithCompensation) {
  for (const Vehicle& vehicle : {star(6, 0.1), star(8, 0.13)}) {
    const Scene scene = clean_scene_of(vehicle);
    const Shadow shadow(vehicle);
    ASSERT_GT(to_degrees(Radians(shadow.arc(vehicle.rotors() - 1, vehicle.o[0]))), 20) << "covered in O";
    const FlightResult plain = fly(kExperiments[kHoverPlain], scene, shadow);
    const FlightResult helped = fly(kExperiments[kHoverCompensated], scene, shadow);
    ASSERT_FALSE(plain.lost || helped.lost);
    EXPECT_NEAR(plain.legs[0].mean_error.z(), 0, 1e-3) << "nothing is covered in X";
    EXPECT_GT(plain.legs[1].mean_error.z(), 0.1);
    EXPECT_LT(std::fabs(helped.legs[1].mean_error.z()), 0.4 * plain.legs[1].mean_error.z());
    EXPECT_NEAR(plain.legs[0].mean_square_speed * bench_line().thrust_coefficient().value(),
                vehicle.build.mass_kg * kGravity / static_cast<double>(vehicle.rotors()), 1e-2)
        << "the mean over the rotors that are there";
  }
}

/// Between the shapes hubs on arms go in arcs, the others straight: they meet again where they rest.
TEST(Flight, OfHubsThatAreToldIsThatOfTheArmsThatPutThemThere) {
  const Vehicle arms = star(6, 0.1), hubs = without_hinges(arms);
  const auto flown = [](const Vehicle& vehicle, ExperimentIndex index) {
    const FlightResult result = fly(kExperiments[index], clean_scene_of(vehicle), Shadow(vehicle));
    EXPECT_FALSE(result.lost);
    return result;
  };
  for (const ExperimentIndex index : {kHoverPlain, kHoverCompensated, kHoverSwitched}) {
    const FlightResult by_arms = flown(arms, index), by_hubs = flown(hubs, index);
    for (std::size_t leg = 0; leg < 3; ++leg)
      EXPECT_LT((by_arms.legs[leg].mean_error - by_hubs.legs[leg].mean_error).norm(), 5e-4) << index << " " << leg;
  }
}

TEST(Trace, HasAColumnForEachRotorAndSaysWhatAHubIsToldBy) {
  for (const bool told : {false, true}) {
    const Vehicle vehicle = told ? without_hinges(star(6, 0.1)) : star(6, 0.1);
    std::vector<TraceRow> trace;
    (void)fly(kExperiments[kLevelSwitched], clean_scene_of(vehicle), Shadow(vehicle), &trace);
    const std::string csv = trace_csv(trace), header = csv.substr(0, csv.find('\n'));
    EXPECT_NE(header.find(told ? ",way6,way1_told" : ",arm6_rad,arm1_told_rad"), std::string::npos) << header;
    EXPECT_NE(header.find("speed6_rad_s"), std::string::npos);
    EXPECT_EQ(header.find("speed7"), std::string::npos);
    const std::string row = csv.substr(header.size() + 1, csv.find('\n', header.size() + 1) - header.size() - 1);
    EXPECT_EQ(std::count(header.begin(), header.end(), ','), std::count(row.begin(), row.end(), ','));
  }
}

/// Neighbours of a symmetric vehicle lose alike: what it is aside is the estimator's noise, no doubt about its arms.
TEST(Verdict, OfASymmetricVehicleDoesNotCallNoiseAPushSideways) {
  Scene scene = example_scene();
  scene.vehicle = star(6, 0.1);
  scene.curves = curves_of(scene.vehicle);
  scene.truth = Truth{};
  scene.truth.thrust_coefficient = bench_line().thrust_coefficient();
  const Shadow shadow(scene.vehicle);
  bool ratio_alone = false;
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    scene.seed = seed;
    const NineFlights flights = fly_all(scene, shadow);
    ratio_alone = ratio_alone || merits_of(flights).hover_xy_ratio() > kSidewaysRatio;
    const Judgement judgement = judgement_of(findings_of({{scene, flights}}));
    EXPECT_EQ(judgement.fitness, Fitness::fit_to_fly) << (judgement.doubts.empty() ? "" : judgement.doubts[0]);
  }
  EXPECT_TRUE(ratio_alone) << "else this shows nothing";
}

}  // namespace rotors_test
}  // namespace kphi::flight
