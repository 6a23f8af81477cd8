#include "fit/flights/flight_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>

#include "base/error.hpp"
#include "base/random.hpp"
#include "compensation/occlusion.hpp"
#include "compensation/units.hpp"
#include "profiles/vehicle.hpp"
#include "test/fit/flights/flown_log.hpp"
#include "test/source_dir.hpp"

namespace kphi::fit {
namespace flight_fit_test {

using flown_log::FlownLog;
using flown_log::Kind;
using ::testing::HasSubstr;

LoggedVehicle drone(double mass_kg = 0.6) {
  const auto file = profiles::load_vehicle(test::source_dir() + "/profiles/foldable_drone.yaml");
  LoggedVehicle vehicle;
  vehicle.name = file.name;
  vehicle.airframe = profiles::airframe_of(file);
  vehicle.build = *file.dynamics;
  vehicle.build_known = true;
  vehicle.mass_kg = mass_kg;
  return vehicle;
}

FlightFit fitted(const FlownLog& flown) {
  const LoggedVehicle vehicle = drone(flown.truth.told_kg);
  return fit_flight(flown_bins(flown.log, vehicle), vehicle);
}

double miss(const Estimate& found, double truth) { return std::abs(found.value - truth) / expanded(found); }

std::string refusal(const FlightLog& log, const LoggedVehicle& vehicle = drone()) {
  try {
    (void)fit_flight(flown_bins(log, vehicle), vehicle);
  } catch (const FitError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(FlightFit, FindsWhatWasFlown) {
  const FlownLog flown = flown_log::fly(Kind::arms_moving, 7);
  const FlightFit fit = fitted(flown);
  EXPECT_LT(miss({fit.k_t, fit.k_t_u, fit.k_t_freedom}, flown.truth.k_t), 1.5);
  EXPECT_NEAR(fit.wide_deg, 65.2, 0.3);
  EXPECT_LT(miss(fit.ratio, flown.truth.ratio(fit.wide_deg * kPi / 180)), 1.5);
  EXPECT_LT(fit.ratio.u, 0.006) << "mass and scale cancel in it";
  EXPECT_GT(fit.k_t_u / fit.k_t, 0.007) << "they do not in K_T";
  EXPECT_NEAR(fit.k_at(30) / fit.k_t, 1 - (1 - fit.ratio.value) * 30 / fit.wide_deg, 1e-12);
}

TEST(FlightFit, ArmsThatStayTellThrustCoefficientAlone) {
  const FlownLog flown = flown_log::fly(Kind::hover_steps, 8);
  const FlightFit fit = fitted(flown);
  EXPECT_TRUE(fit.alone());
  EXPECT_LT(miss({fit.k_t, fit.k_t_u, fit.k_t_freedom}, flown.truth.k_t), 1.5);
  for (const FlightErrorSource& one : fit.sources) EXPECT_DOUBLE_EQ(one.of_k_t, one.of_k_wide) << one.name;
}

TEST(FlightFit, NamesTheDamagedPropeller) {
  const FlownLog flown = flown_log::fly(Kind::damaged, 9);
  const FlightFit fit = fitted(flown);
  ASSERT_TRUE(fit.weak_rotor);
  EXPECT_EQ(static_cast<int>(*fit.weak_rotor), flown.truth.weak);
  EXPECT_TRUE(fit.rotors_told);
}

TEST(FlightFit, CommandsTellLagAndLawAndLittleOfThrustCoefficient) {
  const FlownLog flown = flown_log::fly(Kind::commands, 10);
  const FlightFit fit = fitted(flown);
  ASSERT_TRUE(fit.lag_s && fit.law);
  EXPECT_LT(miss(*fit.lag_s, flown.truth.lag_s), 1.5);
  EXPECT_LT(miss(*fit.law, flown.truth.law), 1.5);
  EXPECT_GT(fit.k_t_u / fit.k_t, 0.09) << "the speed at full command is not known";
  EXPECT_LT(miss(fit.ratio, flown.truth.ratio(fit.wide_deg * kPi / 180)), 1.5);
}

TEST(FlightFit, TheMassIsInThrustCoefficientAndNotInTheRatio) {
  const FlownLog flown = flown_log::fly(Kind::wrong_mass, 11);
  const FlightFit fit = fitted(flown);
  const double off = flown.truth.told_kg / flown.truth.mass_kg;
  EXPECT_NEAR(fit.k_t / flown.truth.k_t / off, 1, 0.02);
  EXPECT_LT(miss(fit.ratio, flown.truth.ratio(fit.wide_deg * kPi / 180)), 1.5);
}

/// A vehicle that rises and sinks a little, without anything but thrust: for vehicles that no generator flies.
FlightLog plain_log(const LoggedVehicle& vehicle, std::size_t rotors, double k_t, double ratio_wide,
                    const std::function<double(double)>& share_of_way,
                    const std::function<double(double, std::size_t)>& arm,
                    const std::function<double(double)>& phi_share) {
  FlightLog log;
  log.rotor_speed.resize(rotors);
  if (!vehicle.hubs) log.arm_angle.resize(rotors);
  Random random(5);
  for (int n = 0; n < 9000; ++n) {
    const double time = 0.01 * n, kept = 1 - (1 - ratio_wide) * phi_share(share_of_way(time));
    double thrust = 0;
    for (std::size_t i = 0; i < rotors; ++i) {
      const double wave = 1 + 0.05 * std::sin(0.8 * time) + 0.02 * std::sin(1.7 * time + static_cast<double>(i));
      const double speed = std::sqrt(9.80665 * vehicle.mass_kg / static_cast<double>(rotors) / k_t / kept * wave);
      thrust += k_t * kept * speed * speed;
      log.rotor_speed[i].time_s.push_back(time);
      log.rotor_speed[i].values.push_back(speed);
      if (vehicle.hubs) continue;
      log.arm_angle[i].time_s.push_back(time);
      log.arm_angle[i].values.push_back(arm(share_of_way(time), i));
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      log.specific_force[axis].time_s.push_back(time);
      log.specific_force[axis].values.push_back((axis == 2 ? thrust / vehicle.mass_kg : 0) + 0.05 * random.normal());
    }
    for (FlightChannel* channel : {&log.height, &log.climb}) {
      channel->time_s.push_back(time);
      channel->values.push_back(channel == &log.height ? 1.5 : 0);
    }
  }
  return log;
}

LoggedVehicle vehicle_of(const std::string& name) {
  const auto file = profiles::load_vehicle(test::source_dir() + "/profiles/" + name);
  LoggedVehicle vehicle;
  vehicle.name = file.name;
  vehicle.airframe = profiles::airframe_of(file);
  if (file.dynamics) vehicle.build = *file.dynamics;
  vehicle.build_known = file.dynamics.has_value();
  vehicle.mass_kg = 0.9;
  if (!file.hubs.empty()) vehicle.hubs = file.hubs.begin()->second;
  return vehicle;
}

TEST(FlightFit, TakesSixRotors) {
  const LoggedVehicle hexa = vehicle_of("foldable_hexa.yaml");
  const double wide = compensation::occlusion_of_arm(hexa.airframe, 0, from_degrees(180)).value();
  ASSERT_GT(wide, 0.2);
  const auto way = [](double time) { return std::fmod(time, 20) < 10 ? 0.0 : 1.0; };
  const auto arm = [](double share, std::size_t) { return from_degrees(60 + 120 * share).value(); };
  const FlightLog log = plain_log(hexa, 6, 1.5e-6, 0.8, way, arm, [](double share) { return share; });
  const FlightFit fit = fit_flight(flown_bins(log, hexa), hexa);
  EXPECT_NEAR(fit.k_t / 1.5e-6, 1, 0.01);
  EXPECT_NEAR(fit.wide_deg, to_degrees(Radians(wide)), 0.06);
  EXPECT_NEAR(fit.ratio.value, 0.8, 0.005);
  EXPECT_EQ(fit.rotors.size(), 6u);
}

TEST(FlightFit, TakesHubsThatAreToldInOneShape) {
  const LoggedVehicle quad = vehicle_of("telescoping_quad.yaml");
  ASSERT_TRUE(quad.hubs);
  const auto none = [](double) { return 0.0; };
  const FlightLog log = plain_log(quad, quad.hubs->size(), 1.5e-6, 1, none, {}, none);
  const FlightFit fit = fit_flight(flown_bins(log, quad), quad);
  EXPECT_TRUE(fit.alone());
  EXPECT_NEAR(fit.k_t / 1.5e-6, 1, 0.01);
}

TEST(FlightFit, RefusesOtherFramesAndUnits) {
  FlightLog log = flown_log::fly(Kind::hover_steps, 12, {.seconds = 60}).log;
  for (double& one : log.specific_force[2].values) one = -one;
  EXPECT_THAT(refusal(log), HasSubstr("z points down"));
  for (double& one : log.specific_force[2].values) one /= -9.80665;
  EXPECT_THAT(refusal(log), HasSubstr("that is g"));
  for (double& one : log.specific_force[2].values) one = std::min(one * 9.80665, 10.0);
  EXPECT_THAT(refusal(log), HasSubstr("end of its range"));
}

TEST(FlightFit, RefusesRotorsInAnotherOrder) {
  FlightLog log = flown_log::fly(Kind::arms_moving, 13).log;
  std::ranges::reverse(log.rotor_speed);
  EXPECT_THAT(refusal(log), HasSubstr("their order in the log is not that"));
}

TEST(FlightFit, RefusesWhatIsMissing) {
  const FlightLog log = flown_log::fly(Kind::arms_moving, 14, {.seconds = 60}).log;
  FlightLog less = log;
  less.rotor_speed.pop_back();
  EXPECT_THAT(refusal(less), HasSubstr("neither speed nor command of all 4 rotors"));
  less = log;
  less.arm_angle.clear();
  EXPECT_THAT(refusal(less), HasSubstr("--shape"));
  less = log;
  less.specific_force[1] = {};
  EXPECT_THAT(refusal(less), HasSubstr("along all three axes"));
  less = flown_log::fly(Kind::arms_moving, 14, {.seconds = 26}).log;
  EXPECT_THAT(refusal(less), HasSubstr("of flight can be used, a fit needs 20 s"));
  EXPECT_THAT(refusal(log, drone(0)), HasSubstr("--mass"));
}

}  // namespace flight_fit_test
}  // namespace kphi::fit
