#include "drivers/sim/netbox/signal.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.hpp"
#include "drivers/sim/physics/motor.hpp"

namespace kphi::sim::signal_test {

constexpr double kPi = 3.14159265358979323846;

/// Amplitude ratio at a frequency, measured over one second after one second.
double gain(LowPass filter, double hz) {
  double sine = 0, cosine = 0;
  for (int i = 0; i < 2 * kTicksPerSecond; ++i) {
    const double phase = 2 * kPi * hz * i / kTicksPerSecond;
    const double out = filter.step(std::sin(phase));
    if (i < kTicksPerSecond) continue;
    sine += out * std::sin(phase);
    cosine += out * std::cos(phase);
  }
  return 2 * std::hypot(sine, cosine) / kTicksPerSecond;
}

TEST(LowPass, AllTwelveHaveGainOneAtRestAndHalfPowerAtTheirCutoff) {
  for (const double cutoff : kFilterCutoffsHz) {
    if (cutoff == 0) continue;
    LowPass filter(cutoff);
    filter.step(0);
    double out = 0;
    for (int i = 0; i < 5 * kTicksPerSecond; ++i) out = filter.step(1);
    EXPECT_NEAR(out, 1, 1e-9) << cutoff;
    EXPECT_NEAR(gain(LowPass(cutoff), cutoff), std::sqrt(0.5), 2e-3) << cutoff;
  }
}

TEST(LowPass, BeginsSettled) {
  LowPass filter(5);
  for (int i = 0; i < 10; ++i) EXPECT_NEAR(filter.step(3), 3, 1e-12);
}

TEST(LowPass, TakesNoiseAwayWhichTheRateDoesNot) {
  NetBoxSettings settings;
  settings.filter = 5;  // 35 Hz
  NetBoxSignal filtered(settings), plain(NetBoxSettings{});
  Random random(1);
  double with = 0, without = 0;
  for (int i = 0; i < 70000; ++i) {
    const Wrench w{0, 0, 0.044 * random.normal(), 0, 0, 0};
    filtered.measure(w);
    plain.measure(w);
    with += std::pow(1e-6 * filtered.counts()[2], 2);
    without += std::pow(1e-6 * plain.counts()[2], 2);
  }
  EXPECT_NEAR(std::sqrt(without / 70000), 0.044, 0.001);
  EXPECT_LT(std::sqrt(with / 70000), 0.0127);
}

TEST(NetBoxSignal, GageBiasShiftsByItsShareOfTheRange) {
  NetBoxSettings settings;
  settings.bias_vector[2] = 16384;
  NetBoxSignal signal(settings);
  signal.measure({0, 0, 31, 0, 0, 0});
  EXPECT_EQ(signal.counts()[2], 1'000'000);
}

TEST(NetBoxSignal, CountsFollowTheUnits) {
  NetBoxSettings settings;
  settings.slots[0].force_unit = 1;
  NetBoxSignal signal(settings);
  signal.measure({0, 0, 44.482216152605, 0, 0, 0.5});
  EXPECT_EQ(signal.counts()[2], 10) << "lbf";
  EXPECT_EQ(signal.counts()[5], 500'000);
}

TEST(NetBoxSignal, AxiaHoldsTheSaturationBit) {
  NetBoxSettings settings;
  settings.quirks.axia = true;
  NetBoxSignal signal(settings);
  signal.measure({0, 0, 99, 0, 0, 0});
  for (int i = 0; i < 31; ++i) {
    signal.measure({});
    EXPECT_TRUE(signal.saturated()) << i;
  }
  signal.measure({});
  EXPECT_FALSE(signal.saturated());
}

}  // namespace kphi::sim::signal_test
