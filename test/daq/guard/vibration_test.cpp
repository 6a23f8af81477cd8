#include "daq/guard/vibration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace kphi::daq {
namespace vibration_test {

constexpr double kRate = 7000, kPerNewton = 1e6, kPerNewtonMetre = 2e6, kTurn = 2 * std::numbers::pi;

/// One second of a cell whose thrust axis shows `amplitude_n` at `line_hz` over 8 N, whose Tx shakes, and noise.
Vibration of(double line_hz, double amplitude_n, double noise_n, int blades, double speed_rad_s, double rate = kRate) {
  VibrationMeter meter(2, blades, rate, kPerNewton, kPerNewtonMetre);
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, noise_n);
  for (int i = 0; i < static_cast<int>(rate); ++i) {
    const double t = i / rate;
    const double fz = 8 + amplitude_n * std::sin(kTurn * line_hz * t + 1) + noise(random);
    const double tx = 0.01 * std::sin(kTurn * 40 * t);
    (void)meter.add({static_cast<std::int32_t>(std::lround(kPerNewton * noise(random))), 0,
                     static_cast<std::int32_t>(std::lround(kPerNewton * fz)),
                     static_cast<std::int32_t>(std::lround(kPerNewtonMetre * tx)), 0, 0},
                    speed_rad_s);
  }
  return meter.newest();
}

TEST(Vibration, IsTheScatterOfEachAxisAboutItsMean) {
  const Vibration seen = of(300, 0.2, 0.05, 3, kTurn * 100);
  EXPECT_NEAR(seen.rms[0], 0.05, 0.003);
  EXPECT_EQ(seen.rms[1], 0);
  EXPECT_NEAR(seen.rms[2], std::hypot(0.2 / std::sqrt(2), 0.05), 0.003) << "whatever the mean is";
  EXPECT_NEAR(seen.rms[3], 0.01 / std::sqrt(2), 1e-4) << "N m";
}

TEST(Vibration, FindsTheBladesInTheThrust) {
  for (const double rps : {20.0, 100.0, 318.3}) {
    const Vibration seen = of(3 * rps, 0.2, 0.05, 3, kTurn * rps);
    EXPECT_NEAR(seen.blade_pass_hz, 3 * rps, 1e-9);
    EXPECT_NEAR(seen.blade_pass_n, 0.2, 0.006) << rps;
  }
}

TEST(Vibration, FindsNoBladesWhereThereAreNone) {
  EXPECT_LT(of(50, 0.5, 0.05, 3, kTurn * 100).blade_pass_n, 0.01) << "another line";
}

TEST(Vibration, KnowsNoLineOfUnknownBladesOfARotorAtRestOrBeyondTheRate) {
  for (const auto& [blades, rps, rate] : {std::tuple(0, 100.0, kRate), {3, 0.0, kRate}, {3, 318.0, 2000.0}}) {
    const Vibration seen = of(300, 0.2, 0.05, blades, kTurn * rps, rate);
    EXPECT_TRUE(std::isnan(seen.blade_pass_hz) && std::isnan(seen.blade_pass_n)) << rps;
    EXPECT_GT(seen.rms[2], 0.1);
  }
}

TEST(Vibration, IsUnknownBeforeTheFirstWindow) {
  VibrationMeter meter(2, 3, kRate, kPerNewton, kPerNewtonMetre);
  for (int i = 0; i < 3499; ++i) EXPECT_FALSE(meter.add({}, 600));
  EXPECT_TRUE(std::isnan(meter.newest().rms[0]));
  EXPECT_TRUE(meter.add({}, 600));
  EXPECT_EQ(meter.newest().rms[0], 0);
}

}  // namespace vibration_test
}  // namespace kphi::daq
