// The C interface gives the numbers of the classes, bit for bit.
#include "compensation/kphi_compensation.h"

#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <string>

#include "test/compensation/example_vehicle.hpp"

namespace kphi::compensation {
namespace kphi_compensation_test {

kphi_curve plain_line() {
  const ThrustCurve line = paper_line();
  kphi_curve plain{};
  plain.thrust_coefficient = line.thrust_coefficient().value();
  plain.intercept = line_of(line).intercept.value();
  plain.slope_per_rad = line_of(line).slope_per_rad;
  plain.largest_fitted_rad = line.largest_fitted().value();
  return plain;
}

kphi_airframe plain_airframe() {
  const Airframe airframe = example_airframe();
  kphi_airframe plain{};
  plain.half_side = airframe.half_side.value();
  plain.arm_length = airframe.arm_length.value();
  plain.propeller_radius = airframe.propeller_radius.value();
  plain.fastest_speed = airframe.fastest_speed.value();
  for (int i = 0; i < 4; ++i) plain.hinge_turns[i] = i;
  return plain;
}

kphi_compensator built(const kphi_airframe& airframe, int law = KPHI_LAW_CLAMPED) {
  const kphi_curve lines[4] = {plain_line(), plain_line(), plain_line(), plain_line()};
  kphi_compensator compensator;
  EXPECT_EQ(kphi_compensator_build(&compensator, lines, &airframe, law), 0);
  return compensator;
}

template <class Unit>
void expect_same(const double (&plain)[4], const Rotors<Quantity<Unit>>& typed) {
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(std::memcmp(&plain[i], &typed[i], sizeof(double)), 0);
}

TEST(PlainInterface, GivesTheNumbersOfTheClassBitForBit) {
  for (const int law : {KPHI_LAW_CLAMPED, KPHI_LAW_PUBLISHED}) {
    kphi_compensator plain = built(plain_airframe(), law);
    Compensator typed = example_compensator(static_cast<ScalingLaw>(law));
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> theta(-2, 3.5), thrust(-1, 9);
    for (int i = 0; i < 1000; ++i) {
      const double arms[4] = {theta(random), theta(random), theta(random), theta(random)};
      const double thrusts[4] = {thrust(random), thrust(random), thrust(random), thrust(random)};
      kphi_set_arms(&plain, arms);
      typed.set_arms({Radians(arms[0]), Radians(arms[1]), Radians(arms[2]), Radians(arms[3])});
      kphi_enable(&plain, i % 3);
      typed.enable(i % 3 != 0);
      double got[4];
      unsigned short flags[4];
      kphi_speeds_for(&plain, thrusts, got, flags);
      const SpeedCommand command = typed.speeds_for(thrusts_of(thrusts[0], thrusts[1], thrusts[2], thrusts[3]));
      expect_same(got, command.speeds);
      for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(flags[j], command.flags[j].bits());
      kphi_occlusion_angles(&plain, got);
      expect_same(got, typed.occlusion_angles());
      kphi_thrust_max(&plain, got);
      expect_same(got, typed.thrust_max());
      kphi_scaling_factors(&plain, got);
      for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(got[j], typed.scaling_factors()[j]);
      kphi_drag_scale(&plain, got);
      for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(got[j], typed.drag_scale()[j]);
    }
  }
}

TEST(PlainInterface, TellsTheUncertaintyWhereTheLineHasOne) {
  kphi_curve line = plain_line();
  line.has_uncertainty = 1;
  line.thrust_coefficient_error = 0.01 * line.thrust_coefficient;
  line.intercept_variance = 4e-18;
  const kphi_curve lines[4] = {line, line, line, plain_line()};
  const kphi_airframe airframe = plain_airframe();
  kphi_compensator compensator;
  ASSERT_EQ(kphi_compensator_build(&compensator, lines, &airframe, KPHI_LAW_CLAMPED), 0);
  const double x[4] = {0.8, kPi, 0.8, 0.8}, thrusts[4] = {1, 1, 1, 1};
  kphi_set_arms(&compensator, x);
  double speeds[4], uncertainties[4];
  kphi_speeds_for(&compensator, thrusts, speeds, nullptr);
  kphi_speed_uncertainties(&compensator, lines, thrusts, 0, uncertainties);
  EXPECT_NEAR(uncertainties[0] / speeds[0], 0.005, 1e-12);
  EXPECT_NEAR(uncertainties[1] / speeds[1], 0.5 * 2e-9 * speeds[1] * speeds[1], 1e-12) << "of k = 1 N over speed²";
  EXPECT_EQ(uncertainties[3], kInfinity);
}

TEST(PlainInterface, TakesATableATrendAndATorqueAsTheClassDoes) {
  ThrustCurve curve = example_table(0.01);
  const Knot shares[] = {{Radians(0), 1}, {from_degrees(90), 0.8}};
  ASSERT_TRUE(curve.set_torque_share(*OcclusionTable::from(shares, 2)));
  ASSERT_TRUE(curve.set_speed_trend({5e-5, RadPerSec(1500)}));
  kphi_curve plain{};
  plain.largest_fitted_rad = curve.largest_fitted().value();
  curve.visit([](const Line&) { FAIL() << "it is a table"; },
              [&](const OcclusionTable& table) {
                for (const Knot& knot : table)
                  plain.knots[plain.knot_count++] = {knot.occlusion.value(), knot.value, knot.standard_error};
              });
  plain.torque_count = 2;
  for (int i = 0; i < 2; ++i) plain.torque[i] = {shares[i].occlusion.value(), shares[i].value, 0};
  plain.trend_per_rad_s = 5e-5;
  plain.trend_reference = 1500;
  const kphi_curve curves[4] = {plain, plain, plain, plain};
  const kphi_airframe airframe = plain_airframe();
  kphi_compensator compensator;
  ASSERT_EQ(kphi_compensator_build(&compensator, curves, &airframe, KPHI_LAW_CLAMPED), 0);
  EXPECT_EQ(kphi_curve_doubts(&plain, KPHI_LAW_CLAMPED), 0);
  Compensator typed = build_with(curve).compensator.value();
  const double o[4] = {kPi, 2.9, 2.8, kPi}, thrusts[4] = {1, 2, 3, 4};
  kphi_set_arms(&compensator, o);
  typed.set_arms({Radians(o[0]), Radians(o[1]), Radians(o[2]), Radians(o[3])});
  double got[4];
  kphi_speeds_for(&compensator, thrusts, got, nullptr);
  expect_same(got, typed.speeds_for(thrusts_of(1, 2, 3, 4)).speeds);
  kphi_speed_uncertainties(&compensator, curves, thrusts, 0.01, got);
  expect_same(got, typed.speed_uncertainties(Rotors<ThrustCurve>(4, curve), thrusts_of(1, 2, 3, 4), Radians(0.01)));
  kphi_drag_scale(&compensator, got);
  for (std::size_t j = 0; j < 4; ++j) EXPECT_EQ(got[j], typed.drag_scale()[j]);
}

TEST(PlainInterface, TakesAPolygonBody) {
  kphi_airframe airframe = plain_airframe();
  for (int i = 0; i < 4; ++i) airframe.mirrored[i] = i % 2;
  kphi_compensator closed = built(airframe);
  airframe.corner_count = 4;
  const double square[4][2] = {{.045, .045}, {-.045, .045}, {-.045, -.045}, {.045, -.045}};
  std::memcpy(airframe.corners, square, sizeof square);
  std::memcpy(airframe.hinges, square, sizeof square);
  for (int i = 0; i < 4; ++i) airframe.hinge_turn_rad[i] = (i + i % 2) * kPi / 2;
  kphi_compensator general = built(airframe);
  const double o[4] = {kPi, kPi - 0.25, kPi - 0.25, kPi};
  kphi_set_arms(&general, o);
  kphi_set_arms(&closed, o);
  double a[4], b[4];
  kphi_occlusion_angles(&general, a);
  kphi_occlusion_angles(&closed, b);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(a[i], b[i], 1e-12);
}

TEST(PlainInterface, TakesHubsAndABodyOfTwoParts) {
  kphi_airframe airframe = plain_airframe();
  airframe.corner_count = airframe.more_corner_counts[1] = 4;
  const double corners[4][2] = {{0.05, 0.05}, {-0.05, 0.05}, {-0.05, -0.05}, {0.05, -0.05}};
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 2; ++k) {
      airframe.corners[i][k] = corners[i][k] - (k == 0 ? 0.1 : 0);
      airframe.more_corners[1][i][k] = corners[i][k] + (k == 0 ? 0.1 : 0);
    }
  }
  kphi_compensator compensator = built(airframe);
  const double hubs[4][2] = {{0.02, 0}, {-0.02, 0}, {0.3, 0}, {0, 0}}, speeds[4] = {0, 0, 1, 0};
  kphi_set_hubs(&compensator, hubs, speeds, 0.01);
  double phi[4], thrusts[4] = {1, 1, 1, 1}, got[4];
  unsigned short flags[4];
  kphi_occlusion_angles(&compensator, phi);
  EXPECT_GT(phi[0], 0.1);
  EXPECT_NEAR(phi[0], phi[1], 1e-12);
  EXPECT_EQ(phi[2], 0);
  kphi_speeds_for(&compensator, thrusts, got, flags);
  EXPECT_EQ(flags[2], KPHI_ARM_ANGLE_STALE);
  EXPECT_EQ(flags[3], 0);
  kphi_set_hubs(&compensator, hubs, nullptr, 0.6);
  kphi_speeds_for(&compensator, thrusts, got, flags);
  EXPECT_EQ(flags[3], KPHI_ARM_ANGLE_STALE);
  airframe.more_corners[1][1][0] = -0.1;
  kphi_curve lines[4] = {plain_line(), plain_line(), plain_line(), plain_line()};
  EXPECT_NE(kphi_compensator_build(&compensator, lines, &airframe, KPHI_LAW_CLAMPED), 0) << "the parts overlap";
}

TEST(PlainInterface, RefusesInWordsAndBuildsNothing) {
  const auto expect = [](const std::string& words, void (*spoil)(kphi_curve&, kphi_airframe&),
                         int law = KPHI_LAW_CLAMPED) {
    kphi_curve lines[4] = {plain_line(), plain_line(), plain_line(), plain_line()};
    kphi_airframe airframe = plain_airframe();
    spoil(lines[2], airframe);
    kphi_compensator compensator = built(plain_airframe());
    const int code = kphi_compensator_build(&compensator, lines, &airframe, law);
    EXPECT_NE(code, 0);
    EXPECT_NE(std::string(kphi_refusal_text(code)).find(words), std::string::npos) << words;
  };
  expect("K_T", [](kphi_curve& line, kphi_airframe&) { line.thrust_coefficient = 0; });
  expect("overlap measure", [](kphi_curve& line, kphi_airframe&) { line.overlap = KPHI_AREA_SHARE; });
  expect("curve", [](kphi_curve& line, kphi_airframe&) { line.overlap = 3; });
  for (const int count : {-1, 1, 13}) {
    kphi_curve odd = plain_line();
    odd.knot_count = count;
    EXPECT_EQ(kphi_curve_doubts(&odd, KPHI_LAW_CLAMPED), -1) << count;
    odd.knot_count = 0;
    odd.torque_count = count;
    EXPECT_EQ(kphi_curve_doubts(&odd, KPHI_LAW_CLAMPED), -1) << count;
  }
  expect("speed trend", [](kphi_curve& line, kphi_airframe&) { line.trend_per_rad_s = 1e-4; });
  expect("speed trend", [](kphi_curve& line, kphi_airframe&) { line.trend_per_rad_s = kNaN; });
  expect("overlap", [](kphi_curve&, kphi_airframe& a) { a.overlap = -1; });
  expect("corners", [](kphi_curve&, kphi_airframe& a) { a.corner_count = 13; });
  expect("corners", [](kphi_curve&, kphi_airframe& a) { a.corner_count = -1; });
  expect("arm", [](kphi_curve&, kphi_airframe& a) { a.arm_length = 0.05; });
  expect(
      "law", [](kphi_curve&, kphi_airframe&) {}, 2);
  EXPECT_STREQ(kphi_refusal_text(-1), "unknown refusal");
}

TEST(PlainInterface, MixesAsTheClassDoes) {
  const double hubs[4][2] = {{.128, .128}, {-.128, .128}, {-.128, -.128}, {.128, -.12}};
  const int spins[4] = {1, -1, 1, -1};
  RotorLayout layout{Rotors<HubPosition>(4), {1, -1, 1, -1}};
  for (std::size_t i = 0; i < 4; ++i) layout.hubs[i] = {Metres(hubs[i][0]), Metres(hubs[i][1])};
  kphi_mixer plain;
  ASSERT_EQ(kphi_mixer_build(&plain, 4, hubs, spins, 0.0133, 1e-4), 1);
  Mixer typed = Mixer::build(layout, {Metres(0.0133), 1e-4}).value();
  const double scale[4] = {1.2, 1, 1.1, 1}, demand[4] = {8, .3, -.2, .05}, low[4] = {}, high[4] = {3, 3, 2.5, 3};
  ASSERT_EQ(kphi_mixer_set_layout(&plain, hubs, spins, scale), 1);
  ASSERT_TRUE(typed.set_layout(layout, {scale[0], scale[1], scale[2], scale[3]}));
  double thrusts[4], achieved[4];
  const int gave = kphi_mix(&plain, demand, low, high, 0.01, thrusts, achieved);
  const MixedThrusts mixed = typed.mix({Newtons(8), NewtonMetres(.3), NewtonMetres(-.2), NewtonMetres(.05)},
                                       {{}, thrusts_of(3, 3, 2.5, 3)}, NewtonMetres(0.01));
  EXPECT_EQ(gave, mixed.concessions.bits());
  EXPECT_NE(gave, 0);
  expect_same(thrusts, mixed.thrusts);
  EXPECT_EQ(achieved[3], mixed.achieved.yaw.value());
  const int no_spins[4] = {1, 0, 1, -1};
  EXPECT_EQ(kphi_mixer_set_layout(&plain, hubs, no_spins, scale), 0);
  EXPECT_EQ(kphi_mixer_build(&plain, 4, hubs, no_spins, 0.0133, 0), 0);
}

TEST(PlainInterface, KnowsHubsThrottleDoubtsMovingArmsAndItsVersion) {
  kphi_compensator plain = built(plain_airframe());
  const double o[4] = {kPi, kPi, kPi, kPi}, rates[4] = {0, 9, 0, 0}, thrusts[4] = {1, 1, 1, 1};
  kphi_set_moving_arms(&plain, o, rates, 0.02);
  double numbers[4];
  unsigned short flags[4];
  kphi_speeds_for(&plain, thrusts, numbers, flags);
  EXPECT_EQ(flags[0], 0);
  EXPECT_EQ(flags[1], KPHI_ARM_ANGLE_STALE);
  const double degrees[4] = {45, 45, 45, 45};
  kphi_set_arms(&plain, degrees);
  kphi_speeds_for(&plain, thrusts, numbers, flags);
  EXPECT_EQ(flags[2], KPHI_ARM_ANGLE_BEYOND);

  const kphi_masses masses{0.42, {0, 0}, {.045, .045, .045, .045}};
  double hubs[4][2];
  kphi_hubs(&plain, &masses, hubs);
  const RotorLayout layout = with_arms(all_at(180)).layout({0.42, {}, {.045, .045, .045, .045}}, {1, -1, 1, -1});
  EXPECT_EQ(hubs[3][0], layout.hubs[3].x.value()) << "the shape that was believed last";
  kphi_uncovered_thrusts(&plain, thrusts, numbers);
  double factors[4];
  kphi_scaling_factors(&plain, factors);
  EXPECT_NEAR(numbers[0], 1 / factors[0], 1e-12);
  EXPECT_NEAR(kphi_throttle(4, 1, 1), 0.5, 1e-15);

  kphi_curve line = plain_line();
  EXPECT_EQ(kphi_curve_doubts(&line, KPHI_LAW_CLAMPED), 0);
  EXPECT_EQ(kphi_curve_doubts(&line, KPHI_LAW_PUBLISHED), KPHI_STEPS_AT_CONTACT);
  line.slope_per_rad = 1e-7;
  EXPECT_EQ(kphi_curve_doubts(&line, KPHI_LAW_CLAMPED), KPHI_GAINS_WITH_OCCLUSION);
  line.intercept = 0;
  EXPECT_EQ(kphi_curve_doubts(&line, KPHI_LAW_CLAMPED), -1);
  EXPECT_STREQ(kphi_compensation_version(), KPHI_COMPENSATION_VERSION);
  EXPECT_EQ(std::string(KPHI_COMPENSATION_VERSION), std::to_string(KPHI_COMPENSATION_VERSION_MAJOR) + "." +
                                                        std::to_string(KPHI_COMPENSATION_VERSION_MINOR) + "." +
                                                        std::to_string(KPHI_COMPENSATION_VERSION_PATCH));
}

}  // namespace kphi_compensation_test
}  // namespace kphi::compensation
