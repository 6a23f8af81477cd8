#include "profiles/vehicle.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace vehicle_test {

using testing::ElementsAre;
using testing::StartsWith;

std::vector<std::string> refused(const std::string& from, const std::string& to) {
  return refusals([&] { return parse_vehicle(changed(kVehicleText, from, to), "v.yaml"); });
}

TEST(Vehicle, IsReadIntoSiUnits) {
  const Vehicle vehicle = parse_vehicle(kVehicleText, "v.yaml");
  EXPECT_EQ(vehicle.name, "drone");
  EXPECT_EQ(vehicle.half_side, Metres(0.045));
  EXPECT_EQ(vehicle.arm_length, Metres(0.117));
  EXPECT_EQ(vehicle.propeller_radius, Metres(0.0635));
  EXPECT_THAT(vehicle.hinge_turn_deg, ElementsAre(0, 90, 180, 270));
  ASSERT_EQ(vehicle.shapes.size(), 2u);
  EXPECT_EQ(vehicle.shapes.at("X")[3], from_degrees(45));
  EXPECT_EQ(vehicle.shapes.at("O")[2], from_degrees(165.676));
  EXPECT_EQ(vehicle.arm_angle_min, from_degrees(-90));
  EXPECT_EQ(vehicle.arm_angle_max, from_degrees(180));
  EXPECT_EQ(vehicle.speed_min, from_rpm(0));
  EXPECT_EQ(vehicle.speed_max, from_rpm(19100));
  EXPECT_EQ(vehicle.text, kVehicleText);
  EXPECT_EQ(vehicle.path, "v.yaml");
  EXPECT_FALSE(vehicle.dynamics || vehicle.control) << "nothing but a simulated flight needs them";
}

TEST(Vehicle, HasOneArmPerCornerInOrderUnlessItSaysOtherwise) {
  const auto text = changed(kVehicleText, "hinge_turn_deg: [0, 90, 180, 270]\n", "");
  EXPECT_THAT(parse_vehicle(text, "v.yaml").hinge_turn_deg, ElementsAre(0, 90, 180, 270));
}

TEST(Vehicle, EachMistakeEarnsItsRefusal) {
  expect_refusals(
      refused,
      {// Refuses shapes that the servos cannot reach
       {"165.676, 180]", "180.5, 180]",
        "9:17: shapes_deg.O[2]: 180.5 is outside -90 to 180 degrees (arm_angle_min_deg, "
        "arm_angle_max_deg); the servo cannot go there; fix the angle or the range"},
       // Refuses shapes without four arms
       {"[45, 45, 45, 45]", "[45, 45, 45]",
        "8:6: shapes_deg.X: 3 angles, but the vehicle has 4 rotors; give one for each, in the same order"},
       {"[45, 45, 45, 45]", "[45, 45, 45, 45, 45]", "8:6: shapes_deg.X: 5 angles, but the vehicle has 4 rotors…"},
       {"  X: [45, 45, 45, 45]\n  O: [180, 180, 165.676, 180]\n", "  {}\n",
        "8:3: shapes_deg: no keys; write at least 1…"},
       // Refuses arms shorter than the propeller
       {"0.117", "0.0635", "4:15: arm_length_m: 0.0635 is not above 0.0635 m (propeller_radius_m)…"},
       // Wants metres in the key
       {"half_side_m: 0.045", "half_side_mm: 45",
        "3:1: half_side_mm is not a key; the unit is part of the key: write half_side_m and the value in m"},
       {"half_side_m: 0.045", "half_side_m: 45",
        "3:14: half_side_m: 45 is above 10 m; write a value from above 0 to 10 m"},
       // Refuses a file of another kind with one line
       {"kphi-vehicle/1", "kphi-coefficients/2",
        "1:9: this is a coefficients file, expected a vehicle file; name a file that begins with "
        "format: kphi-vehicle/1"},
       // Refuses ranges that are empty
       {"speed_min_rpm: 0", "speed_min_rpm: 19100",
        "13:16: speed_max_rpm: 19100 is not above 19100 (speed_min_rpm); swap or fix the two"},
       // Knows each corner and each measure of the overlap, and gives a corner one arm
       {"[0, 90, 180, 270]", "[90, 0.0, 270, 180]", ""},
       {"[0, 90, 180, 270]", "[0, 90, 90, 270]",
        "6:25: hinge_turn_deg[2]: corner 90 has an arm already; give each corner one arm"},
       {"[0, 90, 180, 270]", "[0, 90, 180, 271]",
        "6:30: hinge_turn_deg[3]: 271 is not allowed; write one of 0, 90, 180, 270"},
       {"half_side_m: 0.045\n", "half_side_m: 0.045\noverlap: rim\n", "4:10: overlap: …"},
       {"half_side_m: 0.045\n", "", "1:1: half_side_m: missing, and body is missing as well…"},
       {"kphi-vehicle/1", "kphi-vehicel/1", "1:9: format: text \"kphi-vehicel/1\" is not allowed…"}});
}

TEST(Vehicle, RefusesRangesThatAreEmpty) {
  EXPECT_THAT(refused("arm_angle_max_deg: 180", "arm_angle_max_deg: -91"),
              testing::Contains(StartsWith("11:20: arm_angle_max_deg: -91 is not above -90")));
}

const std::string kBodyText =
    "body:\n"
    "  corners_m: [[0.1, 0.03], [-0.1, 0.03], [-0.1, -0.03], [0.1, -0.03]]\n"
    "  hinges:\n"
    "    - {x_m: 0.1, y_m: 0.03, turn_deg: 0}\n"
    "    - {x_m: -0.1, y_m: 0.03, turn_deg: 180, mirrored: true}\n"
    "    - {x_m: -0.1, y_m: -0.03, turn_deg: 180}\n"
    "    - {x_m: 0.1, y_m: -0.03, turn_deg: 0, mirrored: true}\n";

std::string vehicle_with_body() {
  const std::string text = changed(kVehicleText, "hinge_turn_deg: [0, 90, 180, 270]\n", "");
  return changed(text, "half_side_m: 0.045\n", kBodyText);
}

TEST(Vehicle, IsTheAirframeThatFlies) {
  const auto text =
      changed(kVehicleText, "[0, 90, 180, 270]", "[0, 90, 270, 180]\narm_mirrored: [false, true, false, true]");
  const compensation::Airframe airframe = airframe_of(parse_vehicle(text, "v.yaml"));
  EXPECT_EQ(airframe.half_side, Metres(0.045));
  EXPECT_EQ(airframe.arm_length, Metres(0.117));
  EXPECT_EQ(airframe.propeller_radius, Metres(0.0635));
  EXPECT_EQ(airframe.fastest_speed, from_rpm(19100));
  EXPECT_THAT(airframe.hinge_turns, ElementsAre(0, 1, 3, 2));
  EXPECT_THAT(airframe.mirrored, ElementsAre(false, true, false, true));
  EXPECT_EQ(airframe.overlap, compensation::OverlapMeasure::rim_arc);
  EXPECT_FALSE(airframe.polygon);
}

TEST(Vehicle, SaysHowItsOverlapIsMeasured) {
  EXPECT_EQ(parse_vehicle(std::string(kVehicleText) + "overlap: load_share\n", "v").overlap,
            compensation::OverlapMeasure::load_share);
}

TEST(Vehicle, MayHaveAnyConvexBody) {
  const Vehicle vehicle = parse_vehicle(vehicle_with_body(), "v.yaml");
  ASSERT_TRUE(vehicle.body);
  EXPECT_EQ(vehicle.body->outline.size(), 4u);
  EXPECT_EQ(vehicle.body->outline.corner(1).x, Metres(-0.1));
  EXPECT_EQ(vehicle.body->hinges[1].turn, from_degrees(180));
  EXPECT_TRUE(vehicle.body->hinges[1].mirrored);
  EXPECT_FALSE(vehicle.body->hinges[2].mirrored);
  EXPECT_TRUE(airframe_of(vehicle).polygon);
}

TEST(Vehicle, RefusesABodyThatIsNotConvexOrGoesClockwise) {
  const auto refusals_of = [](const std::string& from, const std::string& to) {
    return refusals([&] { return parse_vehicle(changed(vehicle_with_body(), from, to), "v"); });
  };
  expect_refusals(refusals_of, {{"[-0.1, 0.03], [-0.1, -0.03]", "[-0.1, -0.03], [-0.1, 0.03]",
                                 "4:14: body.corners_m: not the corners of a convex body…"},
                                {", [-0.1, 0.03], [-0.1, -0.03], [0.1, -0.03]", ", [-0.1, 0.03]",
                                 "4:14: body.corners_m: 2 values; write at least 3…"}});
}

const std::string kFlightText =
    "dynamics:\n"                                // 14
    "  mass_kg: 0.6\n"                           // 15
    "  hub_mass_kg: 0.045\n"                     // 16
    "  body_height_m: 0.04\n"                    // 17
    "  drag_torque_per_thrust_m: 0.0133\n"       // 18
    "  rotor_lag_s: 0.033\n"                     // 19
    "  air_drag_per_s: 0.3\n"                    // 20
    "  morph_s: 1.5\n"                           // 21
    "  rotor_spins: [1, -1, 1, -1]\n"            // 22
    "control:\n"                                 // 23
    "  position_gain_per_s2: [6, 6, 15]\n"       // 24
    "  velocity_gain_per_s: [4, 4, 6]\n"         // 25
    "  attitude_gain_per_s: [8.5, 8.5, 5]\n"     // 26
    "  rate_gain_per_s: [12.7, 12.7, 5]\n"       // 27
    "  torque_weight: 0.5\n"                     // 28
    "  position_error_max_m: [0.6, 0.6, 0.3]\n"  // 29
    "  velocity_error_max_m_s: [1, 1, 0.75]\n"   // 30
    "  collective_min_m_s2: 1\n"                 // 31
    "  assured_yaw_nm: 0.02\n";                  // 32

std::vector<std::string> refused_in_flight(const std::string& from, const std::string& to) {
  return refusals([&] { return parse_vehicle(changed(kVehicleText + kFlightText, from, to), "v.yaml"); });
}

/// With these of the shipped drone the flights of the README and of the tests are flown.
TEST(Vehicle, TellsWhatASimulatedFlightNeeds) {
  for (const Vehicle& vehicle :
       {parse_vehicle(kVehicleText + kFlightText, "v.yaml"), load_vehicle(shipped("foldable_drone.yaml"))}) {
    ASSERT_TRUE(vehicle.dynamics && vehicle.control) << vehicle.name;
    EXPECT_EQ(vehicle.dynamics->mass_kg, 0.6);
    EXPECT_EQ(vehicle.dynamics->hub_mass_kg, 0.045);
    EXPECT_EQ(vehicle.dynamics->body_height_m, 0.04);
    EXPECT_FALSE(vehicle.dynamics->body_inertia);
    EXPECT_EQ(vehicle.dynamics->yaw_arm_m, 0.0133);
    EXPECT_EQ(vehicle.dynamics->rotor_lag_s, 0.033);
    EXPECT_EQ(vehicle.dynamics->air_drag_per_s, 0.3);
    EXPECT_EQ(vehicle.dynamics->morph_s, 1.5);
    EXPECT_EQ(vehicle.dynamics->spin, (Rotors<int>{1, -1, 1, -1}));
    EXPECT_THAT(vehicle.control->gains.position, ElementsAre(6, 6, 15)) << "15: the paper's Table II";
    EXPECT_THAT(vehicle.control->gains.velocity, ElementsAre(4, 4, 6)) << "6: the paper's Table II";
    EXPECT_THAT(vehicle.control->gains.attitude, ElementsAre(8.5, 8.5, 5));
    EXPECT_THAT(vehicle.control->gains.rate, ElementsAre(12.7, 12.7, 5));
    EXPECT_EQ(vehicle.control->gains.torque_weight, 0.5);
    EXPECT_THAT(vehicle.control->gains.position_error_max, ElementsAre(0.6, 0.6, 0.3));
    EXPECT_THAT(vehicle.control->gains.velocity_error_max, ElementsAre(1, 1, 0.75));
    EXPECT_EQ(vehicle.control->gains.smallest_collective, 1);
    EXPECT_EQ(vehicle.control->assured_yaw, 0.02);
  }
}

TEST(Vehicle, RefusesMassesAndGainsThatCannotBe) {
  expect_refusals(refused_in_flight,
                  {{"mass_kg: 0.6\n", "mass_kg: 0.18\n",
                    "16:16: dynamics.hub_mass_kg: 4 times 0.045 kg leave nothing of 0.18 kg (mass_kg) for the "
                    "body; mass_kg is the mass of the whole vehicle, hub_mass_kg of one arm's end"},
                   {"  mass_kg: 0.6\n", "  mass_g: 600\n",
                    "15:3: mass_g is not a key of dynamics; the unit is part of the key: write mass_kg…"},
                   {"[1, -1, 1, -1]", "[1, -1, 2, -1]", "22:24: dynamics.rotor_spins[2]: 2 is not allowed…"},
                   {"[6, 6, 15]", "[6, 6]", "24:25: control.position_gain_per_s2: 2 values; write at least 3…"},
                   {"[6, 6, 15]", "[6, 6, 0]", "24:32: control.position_gain_per_s2[2]: 0 is not above 0…"},
                   {"  rotor_lag_s: 0.033\n", "", "14:1: dynamics.rotor_lag_s is missing…"}});
}

TEST(Vehicle, HasABodyThatIsAPlateOrTellsItsInertia) {
  const std::string plate = "body_height_m: 0.04\n", told = "body_inertia_kg_m2: [1e-3, 1e-3, 2e-3]\n";
  const auto text = changed(kVehicleText + kFlightText, plate, told);
  EXPECT_THAT(*parse_vehicle(text, "v").dynamics->body_inertia, ElementsAre(1e-3, 1e-3, 2e-3));
  expect_refusals(
      refused_in_flight,
      {{"  " + plate, "", "15:3: dynamics: neither body_height_m nor body_inertia_kg_m2…"},
       {plate, plate + "  " + told, "18:23: dynamics.body_inertia_kg_m2: given together with body_height_m…"},
       {plate, "body_inertia_kg_m2: [1e-3, 1e-3, 2.1e-3]\n",
        "17:36: dynamics.body_inertia_kg_m2[2]: 0.0021 is more than the other two…"}});
}

TEST(Vehicle, MayHaveABodyOfSeveralConvexParts) {
  const std::string hinges = "  hinges:\n";
  const auto with = [&](const std::string& parts) {
    return changed(vehicle_with_body(), hinges, "  more_corners_m: [" + parts + "]\n" + hinges);
  };
  const std::string front = "[[0.1, -0.01], [0.15, 0], [0.1, 0.01]]",
                    back = "[[-0.1, 0.01], [-0.15, 0], [-0.1, -0.01]]";
  const Vehicle vehicle = parse_vehicle(with(front + ", " + back), "v.yaml");
  ASSERT_TRUE(vehicle.body->more[0] && vehicle.body->more[1]);
  EXPECT_EQ(vehicle.body->more[1]->corner(1).x, Metres(-0.15));
  EXPECT_TRUE(airframe_of(vehicle).polygon->more[0]);
  const auto refusals_of = [&](const std::string& parts) {
    return refusals([&] { return parse_vehicle(with(parts), "v.yaml"); });
  };
  EXPECT_THAT(refusals_of("[[0.09, -0.01], [0.15, 0], [0.09, 0.01]]"),
              ElementsAre(StartsWith("5:20: body.more_corners_m[0]: overlaps another part of the body")));
  EXPECT_THAT(refusals_of(front + ", " + front), ElementsAre(StartsWith("5:60: body.more_corners_m[1]: overlaps")));
  EXPECT_THAT(refusals_of("[[0.1, 0.01], [0.15, 0], [0.1, -0.01]]"),
              ElementsAre(StartsWith("5:20: body.more_corners_m[0]: not the corners of a convex body")));
}

std::vector<std::string> refused_by(const std::string& file, const std::string& from, const std::string& to) {
  return refusals([&] { return parse_vehicle(changed(read_text(shipped(file)), from, to), "v.yaml"); });
}

TEST(Vehicle, MayHaveThreeToEightArmsWithAnAngleAndASpinForEach) {
  const Vehicle hexa = load_vehicle(shipped("foldable_hexa.yaml"));
  EXPECT_EQ(rotors_of(hexa), 6u);
  EXPECT_EQ(rotors_of(airframe_of(hexa)), 6u);
  EXPECT_EQ(hexa.shapes.at("half").size(), 6u);
  EXPECT_EQ(hexa.dynamics->spin, (Rotors<int>{1, -1, 1, -1, 1, -1}));
  EXPECT_NEAR(hubs_of(hexa, "X")[0].x.value(), 0.25, 1e-12) << "straight out from its corner";
  const std::string last = "    - {x_m: 0.05, y_m: -0.0866, turn_deg: 240}\n";
  expect_refusals(
      [](const std::string& from, const std::string& to) { return refused_by("foldable_hexa.yaml", from, to); },
      {{last, last + last + last + last,
        "10:5: body.hinges: 9 rotors are too many; kphi knows vehicles with 3 to 8 rotors"},
       {"X: [60, 60,", "X: [60,", "21:6: shapes_deg.X: 5 angles, but the vehicle has 6 rotors; give one for each…"},
       {"[1, -1, 1, -1, 1, -1]", "[1, -1, 1, -1]",
        "40:16: dynamics.rotor_spins: 4 spins, but the vehicle has 6 rotors; give one for each, in the same order"},
       {"[1, -1, 1, -1, 1, -1]", "[1, 1, 1, 1, 1, 1]",
        "40:16: dynamics.rotor_spins: no difference of thrusts turns the vehicle about z in the shape O; give half…"},
       {"hub_mass_kg: 0.045", "hub_mass_kg: 0.2",
        "34:16: dynamics.hub_mass_kg: 6 times 0.2 kg leave nothing of 0.9 kg…"}});
}

TEST(Vehicle, MayGiveThePlacesOfItsHubsInsteadOfArms) {
  const Vehicle quad = load_vehicle(shipped("telescoping_quad.yaml"));
  EXPECT_EQ(rotors_of(quad), 4u);
  EXPECT_THAT(shapes_of(quad), ElementsAre("O", "X"));
  EXPECT_EQ(hubs_of(quad, "O")[2].y, Metres(-0.072));
  EXPECT_EQ(airframe_of(quad).polygon->hinges.size(), 4u) << "by which the library counts its rotors";
  const std::string two = "  X: [[0.128, 0.128], [-0.128, 0.128], [-0.128, -0.128], [0.128, -0.128]]\n",
                    begin = "half_side_m: 0.045 ";
  expect_refusals(
      [](const std::string& from, const std::string& to) { return refused_by("telescoping_quad.yaml", from, to); },
      {{", [0.128, -0.128]]", "]", "12:6: shapes_m.X: 3 hubs, but the vehicle has 4 rotors…"},
       {two, "  X: [[0.1, 0], [0.2, 0], [-0.1, 0], [-0.2, 0]]\n",
        "12:6: shapes_m.X: the hubs are on one line, so no difference of thrusts tilts the vehicle about it; no "
        "mixer…"},
       {begin, "arm_length_m: 0.1\nhalf_side_m: 0.045 ",
        "7:15: arm_length_m: belongs to arms with hinges, but shapes_m gives their hubs; keep one of the two"},
       {begin, "shapes_deg: {X: [1, 2, 3, 4]}\nhalf_side_m: 0.045 ", "13:3: shapes_m: given together with shapes_deg…"},
       {begin, "hinge_turn_deg: [0, 90, 180, 270]\nhalf_side_m: 0.045 ", "7:17: hinge_turn_deg: belongs to arms…"}});
  EXPECT_THAT(refused("shapes_deg:", "shapes_m:"), testing::Not(testing::IsEmpty())) << "angles are no places";
  EXPECT_THAT(refused("arm_length_m: 0.117\n", ""), ElementsAre(StartsWith("1:1: arm_length_m: missing; shapes_deg")));
}

/// Three in a line make roll and pitch no more than four do.
TEST(Vehicle, OfThreeRotorsInALineIsRefusedAndOfThreeRoundTheBodyIsNot) {
  const std::string text = changed(read_text(shipped("telescoping_quad.yaml")), "[1, -1, 1, -1]", "[1, -1, 1]");
  const auto of = [&](const std::string& shape) {
    const std::size_t begin = text.find("  X: "), end = text.find("\nspeed_min");
    return refusals(
        [&] { return parse_vehicle(text.substr(0, begin) + "  X: " + shape + "\n" + text.substr(end), "v"); });
  };
  EXPECT_THAT(of("[[0.15, 0], [0, 0], [-0.15, 0]]"),
              ElementsAre(StartsWith("12:6: shapes_m.X: the hubs are on one line")));
  EXPECT_THAT(of("[[0.15, 0], [-0.1, 0.13], [-0.1, -0.13]]"), ElementsAre());
}

TEST(Vehicle, HasOneBody) {
  const auto both = refusals([] {
    return parse_vehicle(vehicle_with_body() + "half_side_m: 0.045\narm_mirrored: [true, true, true, true]\n", "v");
  });
  EXPECT_THAT(both, ElementsAre(StartsWith("19:14: half_side_m: belongs to a square body"),
                                StartsWith("20:15: arm_mirrored: belongs to a square body")));
}

}  // namespace vehicle_test
}  // namespace kphi::profiles
