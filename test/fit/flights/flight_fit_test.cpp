#include "fit/flights/flight_fit.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "base/random.hpp"
#include "base/statistics.hpp"
#include "compensation/occlusion.hpp"
#include "compensation/units.hpp"
#include "fit/flights/flight_result.hpp"
#include "fit/flights/speed_check.hpp"
#include "test/fit/flights/flown_log.hpp"
#include "test/fit/flights/logged_vehicle.hpp"

namespace kphi::fit {
namespace flight_fit_test {

using flown_log::FlownLog;
using flown_log::Kind;
using flown_log::logged_vehicle;
using ::testing::HasSubstr;

FlightFit fitted(const FlownLog& flown) {
  const LoggedVehicle vehicle = logged_vehicle(flown.truth.told_kg);
  return fit_flight(flown_bins(flown.log, vehicle), vehicle);
}

double miss(const Estimate& found, double truth) { return std::abs(found.value - truth) / expanded(found); }

std::string refusal(const FlightLog& log, const LoggedVehicle& vehicle = logged_vehicle()) {
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
  EXPECT_NEAR(fit.wide_deg(), 65.2, 0.3);
  EXPECT_LT(miss(fit.ratio(), flown.truth.ratio(fit.wide_deg() * kPi / 180)), 1.5);
  EXPECT_LT(fit.ratio().u, 0.006) << "mass and scale cancel in it";
  EXPECT_GT(fit.k_t_u / fit.k_t, 0.007) << "they do not in K_T";
  ASSERT_EQ(fit.kept.size(), 1u) << "two shapes";
}

TEST(FlightFit, ArmsThatStayTellThrustCoefficientAlone) {
  const FlownLog flown = flown_log::fly(Kind::hover_steps, 8);
  const FlightFit fit = fitted(flown);
  EXPECT_TRUE(fit.alone());
  EXPECT_LT(miss({fit.k_t, fit.k_t_u, fit.k_t_freedom}, flown.truth.k_t), 1.5);
  for (const FlightErrorSource& one : fit.sources) EXPECT_EQ(one.of.size(), 1u) << one.name;
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
  EXPECT_LT(miss(fit.ratio(), flown.truth.ratio(fit.wide_deg() * kPi / 180)), 1.5);
}

TEST(FlightFit, TheMassIsInThrustCoefficientAndNotInTheRatio) {
  const FlownLog flown = flown_log::fly(Kind::wrong_mass, 11);
  const FlightFit fit = fitted(flown);
  const double off = flown.truth.told_kg / flown.truth.mass_kg;
  EXPECT_NEAR(fit.k_t / flown.truth.k_t / off, 1, 0.02);
  EXPECT_LT(miss(fit.ratio(), flown.truth.ratio(fit.wide_deg() * kPi / 180)), 1.5);
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

TEST(FlightFit, TakesSixRotors) {
  const LoggedVehicle hexa = logged_vehicle(0.9, "foldable_hexa.yaml");
  const double wide = compensation::occlusion_of_arm(hexa.airframe, 0, from_degrees(180)).value();
  ASSERT_GT(wide, 0.2);
  const auto way = [](double time) { return std::fmod(time, 20) < 10 ? 0.0 : 1.0; };
  const auto arm = [](double share, std::size_t) { return from_degrees(60 + 120 * share).value(); };
  const FlightLog log = plain_log(hexa, 6, 1.5e-6, 0.8, way, arm, [](double share) { return share; });
  const FlightFit fit = fit_flight(flown_bins(log, hexa), hexa);
  EXPECT_NEAR(fit.k_t / 1.5e-6, 1, 0.01);
  EXPECT_NEAR(fit.wide_deg(), to_degrees(Radians(wide)), 0.06);
  EXPECT_NEAR(fit.ratio().value, 0.8, 0.005);
  EXPECT_EQ(fit.rotors.size(), 6u);
}

/// Arms of the foldable drone at an angle, and φ there, over the widest.
double phi_deg(const LoggedVehicle& vehicle, double arm_deg) {
  return to_degrees(compensation::occlusion_of_arm(vehicle.airframe, 0, from_degrees(arm_deg)));
}

/// A flight in shapes by turns, 6 s each, whose arms are all at one of these angles, degrees; k falls by `law` of
/// φ/180°.
FlightLog shapes_log(const LoggedVehicle& vehicle, const std::vector<double>& arms_deg,
                     const std::function<double(double)>& law) {
  const auto shape = [&](double time) { return std::fmod(std::floor(time / 6), static_cast<double>(arms_deg.size())); };
  const auto arm_at = [&](double number) { return from_degrees(arms_deg[static_cast<std::size_t>(number)]).value(); };
  return plain_log(
      vehicle, 4, 1.5e-6, 0, shape, [&](double number, std::size_t) { return arm_at(number); },
      [&](double number) { return law(phi_deg(vehicle, arms_deg[static_cast<std::size_t>(number)])); });
}

TEST(FlightFit, TellsAShareOfThrustAtEveryShape) {
  const LoggedVehicle quad = logged_vehicle();
  const std::vector<double> arms{45, 150, 165, 180};
  for (const double bend : {0.0, 2e-5}) {
    const auto law = [&](double phi) { return 0.003 * phi - bend * phi * (65 - phi); };
    const FlightLog log = shapes_log(quad, arms, law);
    const FlownBins bins = flown_bins(log, quad);
    const FlightFit fit = fit_flight(bins, quad);
    ASSERT_EQ(fit.kept.size(), 3u) << bend;
    for (std::size_t j = 0; j < 3; ++j) {
      const double phi = phi_deg(quad, arms[j + 1]);
      EXPECT_NEAR(fit.kept[j].phi_deg, phi, 0.06);
      EXPECT_NEAR(fit.kept[j].ratio.value, 1 - law(phi), 0.004) << phi;
    }
    const Fitted fitted = fitted_of(fit, bins, quad, {}, {.diameter_in = 5});
    EXPECT_EQ(fitted.identification.table.size(), 4u);
    EXPECT_EQ(fitted.analysis.curvature.lack_of_fit.rejected(), bend > 0) << fitted.analysis.curvature.lack_of_fit.p;
  }
}

TEST(FlightFit, RefusesAShapeThatAlwaysCoversRotors) {
  const LoggedVehicle quad = logged_vehicle();
  const auto law = [](double phi) { return 0.003 * phi; };
  EXPECT_THAT(refusal(shapes_log(quad, {180}, law), quad), HasSubstr("rotors lay over the body nearly all the time"));
  const FlownBins bins = flown_bins(shapes_log(quad, {150, 180}, law), quad);
  const FlightFit fit = fit_flight(bins, quad);
  ASSERT_EQ(fit.kept.size(), 1u) << "a line through both shapes";
  EXPECT_NEAR(fit.kept[0].ratio.value, 1 - law(fit.wide_deg()), 0.02);
}

TEST(FlightFit, TakesHubsThatAreToldInOneShape) {
  const LoggedVehicle quad = logged_vehicle(0.9, "telescoping_quad.yaml");
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
  EXPECT_THAT(refusal(log, logged_vehicle(0)), HasSubstr("--mass"));
}

/// As an electronic speed controller with another pole count tells them.
FlightLog with_speeds(FlightLog log, double factor) {
  for (FlightChannel& rotor : log.rotor_speed)
    for (double& one : rotor.values) one *= factor;
  return log;
}

TEST(SpeedCheck, FeelsTheBladesAtAnyRateOfTheLog) {
  for (std::uint64_t seed = 40; seed < 46; ++seed) {  // 100, 250 and 500 Hz: the blades beat at 300
    const SpeedCheck check = check_speeds(flown_log::fly(Kind::arms_moving, seed, {.seconds = 60}).log, 4, 2);
    EXPECT_EQ(check.verdict, SpeedCheck::Verdict::confirmed) << seed << ": " << words(check);
    EXPECT_NEAR(check.beats.value, 2, 0.015) << seed;
  }
}

TEST(SpeedCheck, IsTheBetterClock) {
  double squares = 0;
  for (std::uint64_t seed = 43; seed < 49; ++seed) {
    FlownLog flown = flown_log::fly(Kind::arms_moving, seed, {.seconds = 60});
    FlightPriors priors;
    const double before = priors.speed_u;
    const double gain = correct_speeds(flown.log, check_speeds(flown.log, 4, 2), priors);
    EXPECT_LT(priors.speed_u, before / 2) << seed;
    squares += square((gain * flown.truth.told_speed - 1) / priors.speed_u);
  }
  EXPECT_LT(squares / 6, 3);
  FlownLog other = flown_log::fly(Kind::arms_moving, 43, {.seconds = 60});
  FlightPriors priors;
  EXPECT_EQ(correct_speeds(other.log, check_speeds(other.log, 4, 0), priors), 1) << "blades are not told";
  EXPECT_EQ(priors.speed_u, FlightPriors().speed_u);
}

TEST(SpeedCheck, ContradictsAWrongPoleCount) {
  using enum SpeedCheck::Verdict;
  const FlightLog log = flown_log::fly(Kind::hover_steps, 43, {.seconds = 60}).log;
  for (const double factor : {7.0 / 6, 6.0 / 7, 7.0 / 8, 1.5, 1.02, 0.98}) {
    EXPECT_EQ(check_speeds(with_speeds(log, factor), 4, 2).verdict, contradicted) << factor;
    EXPECT_EQ(check_speeds(with_speeds(log, factor), 4, 0).verdict, contradicted) << factor;
  }
  for (const double factor : {1.01, 0.99}) EXPECT_EQ(check_speeds(with_speeds(log, factor), 4, 2).verdict, confirmed);
  EXPECT_EQ(check_speeds(log, 4, 3).verdict, contradicted) << "of another propeller";
  EXPECT_EQ(check_speeds(log, 4, 0).verdict, whole) << "the number of blades is not told";
  for (const double factor : {2.0, 0.5})
    EXPECT_EQ(check_speeds(with_speeds(log, factor), 4, 2).verdict, whole) << "a rotor out of balance does that, too";
}

TEST(SpeedCheck, ConfirmsNoWrongPoleCountInASlowLog) {
  for (const std::uint64_t seed : {41, 42}) {  // 100 Hz, and rotors that hardly differ: images look like lines
    const FlightLog log = flown_log::fly(Kind::hover_steps, seed, {.seconds = 60}).log;
    for (const double factor : {7.0 / 6, 6.0 / 7})
      EXPECT_NE(check_speeds(with_speeds(log, factor), 4, 2).verdict, SpeedCheck::Verdict::confirmed) << seed;
  }
}

TEST(SpeedCheck, SaysWhatItDoesNotFeel) {
  const FlightLog log = flown_log::fly(Kind::hover_steps, 42, {.seconds = 60, .shake = 0}).log;
  const SpeedCheck check = check_speeds(log, 4, 2);
  EXPECT_EQ(check.verdict, SpeedCheck::Verdict::not_felt) << words(check);
  EXPECT_THAT(words(check), HasSubstr("nothing confirms the logged speeds"));
  EXPECT_EQ(check_speeds({}, 4, 2).verdict, SpeedCheck::Verdict::not_felt);
}

/// What the verdict says of a flight whose speeds are off by a factor, of a drone told `heavier` times as heavy.
Fitted judged(const FlownLog& flown, double factor, double heavier = 1, bool weighed = true) {
  LoggedVehicle vehicle = logged_vehicle(heavier * flown.truth.told_kg);
  vehicle.weighed = weighed;
  const FlightLog log = with_speeds(flown.log, factor);
  const FlownBins bins = flown_bins(log, vehicle);
  return fitted_of(fit_flight(bins, vehicle), bins, vehicle, check_speeds(log, 4, 2), {.diameter_in = 5});
}

std::string doubts_of(const Fitted& fitted) {
  std::string all;
  for (const Doubt& one : fitted.analysis.flight.doubts) all += one.text + "\n";
  return all;
}

TEST(FlightVerdict, RefusesSpeedsThatTheVibrationContradicts) {
  const FlownLog flown = flown_log::fly(Kind::hover_steps, 43, {.seconds = 60});
  const Fitted right = judged(flown, 1);
  EXPECT_NE(right.analysis.flight.readiness(), Readiness::not_yet);
  EXPECT_EQ(doubts_of(right), "");
  EXPECT_THAT(right.analysis.remarks.back(), HasSubstr("nothing in this log shows a wrong mass: K_T goes with it"));
  const Fitted wrong = judged(flown, 7.0 / 6);
  EXPECT_EQ(wrong.analysis.flight.readiness(), Readiness::not_yet);
  EXPECT_THAT(doubts_of(wrong), HasSubstr("look at the pole count"));
}

TEST(FlightVerdict, SaysWhatNothingInTheLogShows) {
  const FlownLog flown = flown_log::fly(Kind::hover_steps, 44, {.seconds = 60, .shake = 0});
  EXPECT_THAT(doubts_of(judged(flown, 7.0 / 6)), HasSubstr("nothing in this log shows a wrong mass or pole count"));
  EXPECT_EQ(judged(flown, 7.0 / 6).analysis.flight.by_doubts(), Readiness::with_care);
  const FlownLog shaken = flown_log::fly(Kind::hover_steps, 45, {.seconds = 60});
  EXPECT_THAT(doubts_of(judged(shaken, 1, 1, false)), HasSubstr("weigh the vehicle with its battery (--mass)"));
}

TEST(FlightVerdict, KnowsWhatPropellersPull) {
  const FlownLog flown = flown_log::fly(Kind::hover_steps, 46, {.seconds = 60});
  const double c_t = flown.truth.k_t * 4 * kPi * kPi / (1.19 * std::pow(0.127, 4));
  const auto by_mass = [&](double wanted) { return judged(flown, 1, wanted / c_t); };
  EXPECT_THAT(doubts_of(by_mass(0.26)), HasSubstr("published ones have 0.05 to 0.2"));
  EXPECT_EQ(doubts_of(by_mass(0.24)), "");
  EXPECT_THAT(doubts_of(by_mass(0.038)), HasSubstr("published ones have 0.05 to 0.2"));
  EXPECT_EQ(doubts_of(by_mass(0.042)), "");
  EXPECT_EQ(by_mass(0.42).analysis.flight.readiness(), Readiness::not_yet);
  EXPECT_EQ(by_mass(0.018).analysis.flight.readiness(), Readiness::not_yet);
}

}  // namespace flight_fit_test
}  // namespace kphi::fit
