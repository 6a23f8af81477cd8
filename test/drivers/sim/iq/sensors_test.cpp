#include "drivers/sim/iq/sensors.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim::sensors_test {

class Sensors : public ::testing::Test {
 protected:
  void step(double seconds) {
    for (int i = 0; i < seconds * kTicksPerSecond; ++i) sensors.step(truth);
  }
  IqReadings read() { return sensors.readings(truth); }

  IqMemory memory{IqQuirks{}};
  MotorState truth;
  IqSensorErrors errors;
  IqSensors sensors{errors, 0.005, 1};
  void make() {
    sensors = IqSensors(errors, 0.005, 1);
    sensors.restart(memory, truth);
  }
};

TEST_F(Sensors, SpeedCarriesTheClocksErrorAndLittleNoise) {
  truth.speed = 1000;
  make();
  double sum = 0, square = 0;
  constexpr int kReadings = 20000;
  for (int i = 0; i < kReadings; ++i) {
    sensors.step(truth);
    const double error = read().speed - 1000 / 1.005;
    sum += error;
    square += error * error;
  }
  EXPECT_NEAR(sum / kReadings, 0, 0.02);
  EXPECT_GT(std::sqrt(square / kReadings), 0.03);
  EXPECT_LT(std::sqrt(square / kReadings), 0.2) << "filtered";
}

TEST_F(Sensors, VoltageIsQuantisedFilteredAndWrongByItsGain) {
  errors.converter_noise = 0;
  make();
  step(0.1);
  EXPECT_NEAR(read().volts, std::round(12 * 1.002 / 0.009) * 0.009, 1e-6);
  truth.supply_volts = 20;
  step(11.0 / kTicksPerSecond);  // of a time constant of 1/(2 pi 100 Hz)
  const double share = 1 - std::exp(-11.0 / kTicksPerSecond * 2 * 3.14159265 * 100);
  EXPECT_NEAR(read().volts, (12 + share * 8) * 1.002, 0.02);
}

TEST_F(Sensors, CurrentHasABiasThatTheOwnerCanTakeAway) {
  errors.converter_noise = 0;
  errors.amps_gain = 0;
  errors.amps_bias = 2;
  truth.supply_amps = 3;
  make();
  step(0.1);
  EXPECT_NEAR(read().amps, 3 + 2 * 0.03, 1e-6);
  memory.store(69, 11, 2050);
  sensors.tune(memory);
  step(0.1);
  EXPECT_NEAR(read().amps, 3, 1e-6);
}

TEST_F(Sensors, MotorCurrentIsByTheModulesOwnResistance) {
  truth.drive_volts = 0.45;
  truth.motor_amps = 8;  // the truth is 0.056 ohm
  make();
  step(0.1);
  EXPECT_NEAR(read().motor_amps, 10, 0.1);
}

TEST_F(Sensors, CoilIsEstimatedFromTheEstimatedCurrentAndStartsAtTheAmbientItWasTold) {
  memory.provide(83, 2, 18);
  truth.drive_volts = 0.9;
  truth.motor_amps = 20;
  truth.coil_celsius = 99;
  make();
  EXPECT_EQ(read().coil_celsius, 18);
  step(0.5);
  // 400 A² on 0.038 ohm into 6 J/°C, hardly cooled yet
  EXPECT_NEAR(read().coil_celsius - 18, 400 * 0.038 * 0.5 / 6, 0.1);
}

TEST_F(Sensors, JoulesAreWhatWasMeasured) {
  truth.supply_amps = 5;
  make();
  step(2);
  EXPECT_NEAR(read().joules, 12 * 5 * 2, 3);
  sensors.restart(memory, truth);
  EXPECT_EQ(read().joules, 0);
}

}  // namespace kphi::sim::sensors_test
