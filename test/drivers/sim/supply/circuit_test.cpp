#include "drivers/sim/supply/circuit.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::sim::circuit_test {

constexpr double kTick = 1.0 / 7000;

/// At 12 V, 3 A, thresholds 13 V and 6 A, on, and settled without load.
SupplyCircuit at_twelve_volts(double amps = 3) {
  SupplyCircuit circuit;
  circuit.controls() = {12, amps, 13, 6};
  circuit.switch_output(true);
  for (int i = 0; i < 700; ++i) circuit.step({}, kTick);
  return circuit;
}

void run(SupplyCircuit& circuit, const SupplyLoad& load, double seconds, double tick = kTick) {
  for (double t = 0; t < seconds; t += tick) circuit.step(load, tick);
}

TEST(SupplyCircuit, HoldsTheVoltageLessTheDropInTheSource) {
  SupplyCircuit circuit = at_twelve_volts();
  EXPECT_NEAR(circuit.volts(), 12, 1e-3);
  run(circuit, {2, 0}, 0.1);
  EXPECT_NEAR(circuit.volts(), 12 - 0.020 * 2, 1e-3);
  EXPECT_NEAR(circuit.amps(), 2, 0.02);
  EXPECT_FALSE(circuit.limiting());
}

TEST(SupplyCircuit, HoldsTheCurrentWhenTheLoadWantsMore) {
  SupplyCircuit circuit = at_twelve_volts(1);
  run(circuit, {0, 0.5}, 0.2);  // 2 ohm: 6 A at 12 V
  EXPECT_TRUE(circuit.limiting());
  EXPECT_NEAR(circuit.amps(), 1, 1e-9);
  EXPECT_NEAR(circuit.volts(), 2, 0.01);
  run(circuit, {0, 0.01}, 0.2);
  EXPECT_FALSE(circuit.limiting());
}

TEST(SupplyCircuit, StaysBelowItsSetVoltageWhileItSags) {
  SupplyCircuit circuit = at_twelve_volts();
  circuit.sag(3);
  run(circuit, {1, 0}, 0.2);
  EXPECT_NEAR(circuit.volts(), 9 - 0.020, 1e-3);
  EXPECT_EQ(circuit.controls().volts, 12);
  circuit.sag(0);
  run(circuit, {1, 0}, 0.2);
  EXPECT_NEAR(circuit.volts(), 12 - 0.020, 1e-3);
}

TEST(SupplyCircuit, TakesNoCurrentBack) {
  SupplyCircuit circuit = at_twelve_volts();
  circuit.controls().over_volts = 100;
  const double before = circuit.volts();
  run(circuit, {-1, 0}, 0.010);
  EXPECT_EQ(circuit.amps(), 0);
  // Q = C U: 1 A for 10 ms on 1270 µF, less what the bleeder takes.
  EXPECT_NEAR(circuit.volts() - before, 0.010 / 1270e-6, 0.2);
}

TEST(SupplyCircuit, TripsWhenTheVoltageRises) {
  SupplyCircuit circuit = at_twelve_volts();
  run(circuit, {-1, 0}, 0.010);
  EXPECT_EQ(circuit.tripped(), SupplyProtection::over_voltage);
  EXPECT_FALSE(circuit.output());
  run(circuit, {}, 10);
  EXPECT_NEAR(circuit.volts(), 0, 0.01) << "the bleeder has emptied the capacitor";
  circuit.switch_output(true);
  EXPECT_EQ(circuit.tripped(), SupplyProtection::none);
}

TEST(SupplyCircuit, TripsOnCurrentAfterAMomentOnly) {
  SupplyCircuit circuit = at_twelve_volts(10);
  run(circuit, {7, 0}, 0.001);
  EXPECT_EQ(circuit.tripped(), SupplyProtection::none);
  run(circuit, {1, 0}, 0.010);
  run(circuit, {7, 0}, 0.010);
  EXPECT_EQ(circuit.tripped(), SupplyProtection::over_current);
}

TEST(SupplyCircuit, IsDeadWhenOff) {
  SupplyCircuit circuit;
  run(circuit, {1, 0}, 0.1);
  EXPECT_EQ(circuit.volts(), 0);
  EXPECT_EQ(circuit.amps(), 0);
}

TEST(SupplyCircuit, IsStableForAnyStep) {
  for (const double tick : {1e-6, 1e-4, 1e-2, 1.0}) {
    SupplyCircuit circuit = at_twelve_volts();
    for (int i = 0; i < 1000; ++i) {
      circuit.step({0, 0.1}, tick);
      ASSERT_LE(circuit.volts(), 12.001);
    }
    if (tick * 1000 > 0.1) {
      EXPECT_NEAR(circuit.volts(), 12 - 0.020 * 1.2, 0.01) << tick;
    }
  }
}

TEST(SupplyCircuit, ShowsItsMeterWithTheLagOfAMeter) {
  SupplyCircuit circuit = at_twelve_volts();
  run(circuit, {2, 0}, 0.010);
  EXPECT_LT(circuit.shown_amps(), 1);
  run(circuit, {2, 0}, 0.5);
  EXPECT_NEAR(circuit.shown_amps(), 2, 0.02);
}

}  // namespace kphi::sim::circuit_test
