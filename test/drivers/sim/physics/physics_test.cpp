#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numeric>
#include <vector>

#include "drivers/sim/iq/control.hpp"
#include "drivers/sim/physics/motor.hpp"
#include "drivers/sim/physics/plant.hpp"

namespace kphi::sim::physics_test {

/// The module's default tuning.
MotorDrive at_speed(double speed) {
  return {MotorDrive::Mode::velocity, speed, 0.02, 0.9, 0, 0.006, 0.0043, 2.0e-7, 100};
}

constexpr MotorDrive kCoast{}, kBrake{.mode = MotorDrive::Mode::brake};

/// The plant under the module's firmware, which measures without error.
struct Stand : Plant {
  using Plant::Plant;
  Stand(std::string_view propeller, double phi_deg, std::uint64_t seed, const PlantParameters& parameters = {})
      : Plant(parameters, seed) {
    mount(find_propeller(propeller), phi_deg);
  }
  void step(const MotorDrive& drive) {
    last = control.step(drive, limits, {motor().speed, motor().supply_volts});
    Plant::step(last);
  }
  IqControl control;
  IqLimits limits;
  PowerStage last;
};

void run(Stand& plant, const MotorDrive& drive, double seconds) {
  for (int i = 0; i < seconds * kTicksPerSecond; ++i) plant.step(drive);
}

double mean_force(Stand& plant, const MotorDrive& drive, std::size_t axis, double seconds) {
  double sum = 0;
  const int ticks = static_cast<int>(seconds * kTicksPerSecond);
  for (int i = 0; i < ticks; ++i) {
    plant.step(drive);
    sum += plant.reading()[axis];
  }
  return sum / ticks;
}

TEST(Physics, EverySpeedOfTheProfileIsReachedInFiftyMillisecondsAndHeldAfterTwoHundred) {
  for (const auto& propeller : kPropellers) {
    Stand plant({}, 1);
    plant.mount(&propeller, 90);
    const double top = propeller.id == "6x3" ? 1800 : 2000;
    for (int step = 0; step < 40; ++step) {
      const double speed = 10 + (top - 10) * step / 39;
      run(plant, at_speed(speed), 0.05);
      const double soon = std::max(0.01 * speed, 4.0);
      EXPECT_NEAR(plant.motor().speed, speed, soon) << propeller.id << " step " << step;
      run(plant, at_speed(speed), 0.15);
      const double tolerance = std::max(0.001 * speed, 0.2);
      EXPECT_NEAR(plant.motor().speed, speed, tolerance) << propeller.id << " step " << step;
      double sum = 0;
      for (int i = 0; i < kTicksPerSecond / 2; ++i) {
        plant.step(at_speed(speed));
        sum += plant.motor().speed;
      }
      EXPECT_NEAR(sum / (kTicksPerSecond / 2) / speed, 1, 5e-4) << propeller.id << " step " << step;
    }
  }
}

TEST(Physics, SteadyThrustIsKOmegaSquaredAboveTheZero) {
  for (const double phi : {0.0, 45.0, 270.0}) {
    Stand plant("5x3", phi, 5);
    const double zero = mean_force(plant, kCoast, 2, 2);
    run(plant, at_speed(1500), 1);
    const double expected = thrust_coefficient(*find_propeller("5x3"), phi) * 1500 * 1500;
    EXPECT_NEAR(mean_force(plant, at_speed(1500), 2, 2) - zero, expected, 2e-3 + 1e-3 * expected) << phi;
  }
}

TEST(Physics, ReactionTorqueOpposesThePositiveTurn) {
  Stand plant("6x2", 0, 5);
  const double zero = mean_force(plant, kCoast, 5, 1);
  run(plant, at_speed(1500), 1);
  EXPECT_NEAR(mean_force(plant, at_speed(1500), 5, 1) - zero, -2.4e-8 * 1500 * 1500, 2e-4);
}

TEST(Physics, NegativeSpeedPushes) {
  Stand plant("5x2", 0, 5);
  run(plant, at_speed(-1000), 1);
  EXPECT_NEAR(plant.motor().speed, -1000, 1);
  EXPECT_LT(plant.thrust(), 0);
}

TEST(Physics, CoastingSlowsDownAndStopsWithoutDrawingCurrent) {
  Stand plant("5x3", 0, 2);
  run(plant, at_speed(2000), 1);
  double last = plant.motor().speed;
  for (int i = 0; i < 20; ++i) {
    run(plant, kCoast, 0.1);
    EXPECT_LT(plant.motor().speed, last);
    EXPECT_EQ(plant.motor().motor_amps, 0);
    last = plant.motor().speed;
  }
  run(plant, kCoast, 8);
  EXPECT_EQ(plant.motor().speed, 0);
  EXPECT_NEAR(plant.thrust(), 0, 1e-9);
}

TEST(Physics, SteppingDownLiftsTheBusToTheLimitAndNoFurther) {
  Stand plant("6x3", 0, 2);
  run(plant, at_speed(1800), 1);
  double highest = 0;
  for (int i = 0; i < 7000; ++i) {
    plant.step(at_speed(200));
    ASSERT_GE(plant.motor().source_amps, -1e-6) << "the supply takes nothing back";
    highest = std::max(highest, plant.motor().supply_volts);
  }
  EXPECT_GT(highest, 26);
  EXPECT_LT(highest, 27.2);
}

TEST(Physics, WithTheLimitTooHighSteppingDownLiftsTheBusFarAboveTheSupply) {
  Stand plant("6x3", 0, 2);
  plant.limits.volts_start = plant.limits.volts_limit = 100;
  run(plant, at_speed(1800), 1);
  double highest = 0;
  for (int i = 0; i < 1000; ++i) {
    plant.step(at_speed(200));
    highest = std::max(highest, plant.motor().supply_volts);
  }
  EXPECT_GT(highest, 35);
}

TEST(Physics, WithTheVoltageLimitBelowTheSupplyTheMotorRunsAway) {
  Stand plant("5x2", 0, 2);
  plant.limits.volts_start = 10;
  plant.limits.volts_limit = 11;
  run(plant, at_speed(300), 2);
  EXPECT_GT(plant.motor().speed, 1200);
}

TEST(Physics, ClosedLoopRisesInAboutTwentyMilliseconds) {
  Stand plant("5x3", 0, 2);
  run(plant, at_speed(1000), 1);
  int ticks = 0;
  for (; plant.motor().speed < 1000 + 0.63 * 100; ++ticks) {
    ASSERT_LT(ticks, kTicksPerSecond);
    plant.step(at_speed(1100));
  }
  EXPECT_GT(ticks * kTick, 0.002);
  EXPECT_LT(ticks * kTick, 0.030);
}

TEST(Physics, RedlineScalesTheVoltage) {
  Stand plant("5x2", 0, 2);
  plant.limits.redline_start = 900;
  plant.limits.redline_end = 1100;
  run(plant, at_speed(1500), 2);
  EXPECT_LT(plant.motor().speed, 1100);
  EXPECT_LT(plant.control.derate(), 1);
  EXPECT_GT(plant.motor().speed, 900);
}

TEST(Physics, SlewLimitHoldsTheVoltageBack) {
  Stand plant("5x2", 0, 2);
  plant.limits.slew = 100;
  run(plant, MotorDrive{.mode = MotorDrive::Mode::volts, .target = 5}, 0.02);
  EXPECT_NEAR(plant.control.volts(), 2, 0.05);
}

TEST(Physics, InputFilterSlowsTheCommandDown) {
  Stand fast({}, 2), slow({}, 2);
  MotorDrive drive = at_speed(500);
  fast.step(drive);
  run(fast, drive, 0.03);
  drive.input_filter_hz = 1;
  run(slow, drive, 0.03);
  EXPECT_LT(slow.motor().speed, 0.4 * fast.motor().speed);
}

TEST(Physics, ALockedRotorDrawsItsCurrentAndDoesNotTurn) {
  Stand plant("5x2", 0, 2);
  plant.upset({0, true});
  run(plant, at_speed(1000), 0.2);
  EXPECT_EQ(plant.motor().speed, 0);
  EXPECT_NEAR(plant.motor().motor_amps, 30, 1);
}

TEST(Physics, ASagOfTheSupplyIsSeenAtTheModule) {
  Stand plant({}, 2);
  plant.upset({-4, false});
  run(plant, kCoast, 0.1);
  EXPECT_NEAR(plant.motor().supply_volts, 8, 0.01);
}

TEST(Physics, BrakeStopsFasterThanCoast) {
  Stand coasting("5x3", 0, 2), braking("5x3", 0, 2);
  for (Stand* plant : {&coasting, &braking}) run(*plant, at_speed(1000), 1);
  run(coasting, kCoast, 0.1);
  run(braking, kBrake, 0.1);
  EXPECT_LT(braking.motor().speed, 0.3 * coasting.motor().speed);
}

/// A campaign in small: up, steady, down into the limiter, brake, coast to rest.
void exercise(Stand& plant, const std::function<void()>& each) {
  for (const auto& [drive, seconds] : {std::pair{at_speed(1800), 1.0},
                                       {at_speed(900), 0.4},
                                       {kCoast, 0.2},
                                       {at_speed(-700), 0.5},
                                       {kBrake, 0.1},
                                       {kCoast, 6.0}}) {
    for (int i = 0; i < seconds * kTicksPerSecond; ++i) {
      plant.step(drive);
      each();
    }
  }
}

/// By the state alone: what the source gives is stored, heats, or turns the shaft; what turns the shaft is given to the
/// air, stored, or rubbed away.
TEST(Physics, EnergyIsConserved) {
  PlantParameters parameters;
  parameters.motor.turbulence = 0;
  const MotorParameters& p = parameters.motor;
  const PropellerTruth& propeller = *find_propeller("5x3");
  Stand plant("5x3", 0, 3, parameters);
  const double inertia = propeller.inertia_kg_m2 + p.rotor_inertia;
  double to_shaft = 0, to_air = 0, turned = 0, rubbed = 0;  // J, J, rad of either direction, J
  MotorState before = plant.motor();
  exercise(plant, [&] {
    const MotorState now = plant.motor();
    const double electrical = now.drive_volts * now.motor_amps,
                 shaft = p.torque_constant * now.motor_amps * now.turning_speed;
    ASSERT_GE(electrical - shaft, -1e-9) << "copper only takes";
    const double charging = p.bus_capacitance * (now.supply_volts - before.supply_volts) * kTicksPerSecond;
    ASSERT_NEAR(now.supply_volts * (now.source_amps - charging - p.idle_current), electrical, 1e-6);
    to_shaft += shaft * kTick;
    to_air += plant.torque_coefficient() * before.speed * std::abs(before.speed) * now.turning_speed * kTick;
    turned += std::abs(now.turning_speed) * kTick;
    const double friction = to_shaft - to_air - 0.5 * inertia * now.speed * now.speed;
    ASSERT_GE(friction - rubbed, -1e-9);
    rubbed = friction;
    before = now;
  });
  EXPECT_NEAR(rubbed / (p.friction_torque * turned), 1, 1e-3) << "Coulomb: torque times angle";
  EXPECT_GT(to_air, 100);
}

TEST(Physics, TheStagePutsItsShareOfTheBusAcrossTheMotor) {
  Stand plant("5x3", 0, 3);
  double before = 0;
  exercise(plant, [&] {
    const MotorState& m = plant.motor();
    const bool turns_on = before * m.speed > 0;  // else friction changes its sign within the tick
    before = m.speed;
    if (!turns_on || plant.last.mode == PowerStage::Mode::coast) return;
    const double expected = plant.last.mode == PowerStage::Mode::brake ? 0 : plant.last.duty * m.supply_volts;
    ASSERT_NEAR(m.drive_volts, expected, 1e-9);
  });
}

TEST(Physics, TheSupplyGivesWhatItsResistanceOrItsLimitLets) {
  PlantParameters parameters;
  parameters.motor.supply_current_max = 15;
  Stand plant("6x3", 0, 3, parameters);
  bool limited = false, blocked = false;
  exercise(plant, [&] {
    const MotorState& m = plant.motor();
    const double by_resistance = (12 - m.supply_volts) / 0.020;
    const double expected = std::max(0.0, std::min(15.0, by_resistance));
    limited = limited || by_resistance > 15.1;
    blocked = blocked || by_resistance < -1;
    ASSERT_NEAR(m.source_amps, expected, 0.01);
  });
  EXPECT_TRUE(limited);
  EXPECT_TRUE(blocked);
}

TEST(Physics, SupplySagsByItsResistanceAndLimitsItsCurrent) {
  PlantParameters parameters;
  parameters.motor.supply_current_max = 8;
  Stand plant("6x2", 0, 3, parameters);
  run(plant, at_speed(2000), 1);
  EXPECT_LT(plant.motor().speed, 1900) << "this supply cannot give what 2000 rad/s take";
  EXPECT_NEAR(plant.motor().source_amps, 8, 0.2);
  EXPECT_LT(plant.motor().supply_volts, 12 - 0.020 * 8) << "out of its regulation";
}

TEST(Physics, CoilWarmsUnderLoadAndCoolsAtRest) {
  Stand plant("6x3", 0, 3);
  run(plant, at_speed(1800), 10);
  const double hot = plant.motor().coil_celsius;
  EXPECT_GT(hot, 40);
  EXPECT_LT(hot, 90);
  run(plant, kCoast, 30);
  EXPECT_LT(plant.motor().coil_celsius, hot - 5);
  EXPECT_GT(plant.motor().coil_celsius, 25);
}

LoadCellParameters without_disturbance() {
  LoadCellParameters quiet;
  quiet.noise = quiet.zero_spread = quiet.drift_per_minute = quiet.walk_per_root_minute = Wrench{};
  quiet.once_per_turn = quiet.blade_pass = quiet.blade_pass_occluded = 0;
  return quiet;
}

TEST(Physics, ThrustLagsTheSpeedByFortyMilliseconds) {
  Random random(1);
  LoadCell cell(without_disturbance(), random);
  cell.load({1e-6, 1e-6, 2, 0});
  const int lag_ticks = static_cast<int>(0.040 * kTicksPerSecond);
  for (int i = 0; i < lag_ticks; ++i) cell.step(1000, 0, random);
  EXPECT_NEAR(cell.reading()[2], 1 - std::exp(-1), 2e-3);
}

TEST(Physics, ZeroIsSomeTenthsOfANewtonAndDriftsSlowly) {
  double smallest = 1, largest = 0;
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const double zero = std::abs(Stand({}, seed).zero()[2]);
    smallest = std::min(smallest, zero);
    largest = std::max(largest, zero);
  }
  EXPECT_LT(largest, 0.4);
  EXPECT_GT(largest, 0.2);
  PlantParameters parameters;
  parameters.load_cell.walk_per_root_minute = Wrench{};
  Stand plant(parameters, 1);
  const double before = plant.zero()[2];
  run(plant, kCoast, 60);
  EXPECT_NEAR(plant.zero()[2] - before, 2e-3, 1e-5);
}

TEST(Physics, RandomWalkHasItsDeviationAfterAMinute) {
  PlantParameters parameters;
  parameters.load_cell.drift_per_minute = Wrench{};
  double square = 0;
  constexpr int kRuns = 24;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    Stand plant(parameters, seed);
    const double before = plant.zero()[2];
    run(plant, kCoast, 15);
    square += std::pow(plant.zero()[2] - before, 2) * 4;
  }
  EXPECT_NEAR(std::sqrt(square / kRuns), 4e-4, 2e-4);
}

TEST(Physics, WhiteNoiseAtRestHasItsDeviation) {
  Stand plant({}, 11);
  double sum = 0, square = 0;
  constexpr int kTicks = 2 * kTicksPerSecond;
  for (int i = 0; i < kTicks; ++i) {
    plant.step(kCoast);
    const double x = plant.reading()[2] - plant.zero()[2];
    sum += x;
    square += x * x;
  }
  EXPECT_NEAR(std::sqrt(square / kTicks - std::pow(sum / kTicks, 2)), 0.025, 5e-4);
}

/// Amplitude of Fz at a frequency, over one second.
double line(const std::vector<double>& force, double hertz) {
  double cosine = 0, sine = 0;
  for (std::size_t i = 0; i < force.size(); ++i) {
    const double angle = 2 * 3.14159265358979 * hertz * static_cast<double>(i) / kTicksPerSecond;
    cosine += force[i] * std::cos(angle);
    sine += force[i] * std::sin(angle);
  }
  return 2 * std::hypot(cosine, sine) / static_cast<double>(force.size());
}

TEST(Physics, VibrationStandsAtOncePerTurnAndAtTheBladePass) {
  for (const auto& [id, blades] : {std::pair{"5x2", 2}, {"5x3", 3}}) {
    LoadCellParameters parameters = without_disturbance();
    parameters.once_per_turn = 0.015;
    parameters.blade_pass = 0.03;
    Random random(1);
    LoadCell cell(parameters, random);
    cell.load({1e-6, 1e-6, blades, 0});
    const double speed = 2 * 3.14159265358979 * 200;
    std::vector<double> force;
    for (int i = 0; i < 2 * kTicksPerSecond; ++i) {
      cell.step(speed, 0, random);
      if (i >= kTicksPerSecond) force.push_back(cell.reading()[2]);
    }
    const double thrust = 1e-6 * speed * speed;
    EXPECT_NEAR(line(force, 200) / thrust, 0.015, 2e-4) << id;
    EXPECT_NEAR(line(force, 200.0 * blades) / thrust, 0.03, 2e-4) << id;
    EXPECT_NEAR(line(force, 200.0 * (5 - blades)) / thrust, 0, 2e-4) << id;
  }
}

}  // namespace kphi::sim::physics_test
