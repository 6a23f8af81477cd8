// The online estimate of thrust flown over thrust told: its number, its ±, and when it calls the flown k wrong.
#include "compensation/thrust_factor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "compensation/kphi_compensation.h"

namespace kphi::compensation {
namespace thrust_factor_test {

constexpr double kMass = 0.5, kPeriod = 0.004, kMemory = 10, kError = 0.02, kWeight = 9.80665 * kMass;
constexpr double kNoise = 1;  // m/s²

ThrustFactor fresh() { return *ThrustFactor::build({kMass, Seconds(kPeriod), Seconds(kMemory), kError}); }

/// Noise of kNoise whose neighbours correlate by `correlation`.
class Noise {
 public:
  Noise(unsigned seed, double correlation)
      : dice_(seed), keep_(correlation), fresh_(std::sqrt(1 - correlation * correlation)), now_(normal_(dice_)) {}
  double next() { return kNoise * (now_ = keep_ * now_ + fresh_ * normal_(dice_)); }
  double white() { return normal_(dice_); }

 private:
  std::mt19937 dice_;
  std::normal_distribution<float> normal_;
  double keep_, fresh_, now_ = 0;
};

std::size_t samples_of(double seconds) { return static_cast<std::size_t>(seconds / kPeriod); }

/// What the page tells: until then half of the flights have found a k that is wrong by this share; twice that: 95 %.
double told_seconds(double wrong_by, double correlation) {
  const double u = (std::abs(wrong_by) - kError) / ThrustFactor::kSure;
  const double independent = std::pow(kNoise / 9.80665 / u, 2);
  return independent * (1 + correlation) / (1 - correlation) * kPeriod;
}

TEST(ThrustFactor, IsExactWithoutNoise) {
  ThrustFactor factor = fresh();
  EXPECT_FALSE(factor.estimate().known);
  EXPECT_EQ(factor.estimate().u, std::numeric_limits<double>::infinity());
  for (int i = 0; i < 200; ++i) {
    const double told = kWeight * (1 + 0.2 * std::sin(0.1 * i));
    factor.update(0.93 * told / kMass, Newtons(told));
  }
  EXPECT_NEAR(factor.estimate().factor, 0.93, 1e-12);
  EXPECT_EQ(factor.used(), 200u);
  EXPECT_EQ(factor.left_out(), 0u);
}

TEST(ThrustFactor, HoldsTheTruthInItsIntervalInWhiteAndColouredNoise) {
  for (const double correlation : {0.0, 0.5, 0.9}) {
    int held = 0, known = 0;
    for (unsigned seed = 0; seed < 1000; ++seed) {
      ThrustFactor factor = fresh();
      Noise noise(seed, correlation);
      double slow = 0;
      for (std::size_t i = 0; i < samples_of(20); ++i) {
        slow = 0.995 * slow + 0.1 * noise.white();
        const double told = kWeight * std::exp(0.1 * slow);
        factor.update(1.01 * told / kMass + noise.next(), Newtons(told));
      }
      const auto estimate = factor.estimate();
      known += estimate.known ? 1 : 0;
      held += std::abs(estimate.factor - 1.01) < 1.96 * estimate.u ? 1 : 0;
    }
    EXPECT_EQ(known, 1000) << correlation;
    EXPECT_GE(held, 925) << correlation;
    EXPECT_LE(held, 975) << correlation;
  }
}

TEST(ThrustFactor, RarelyCallsAKWrongThatIsWithinItsError) {
  constexpr int kFlights = 150;
  for (const double correlation : {0.0, 0.9}) {
    int alarms = 0;
    for (unsigned seed = 0; seed < kFlights; ++seed) {
      ThrustFactor factor = fresh();
      Noise noise(seed, correlation);
      bool alarm = false;
      // The worst k that is within, for a hundred memories.
      for (std::size_t i = 0; i < samples_of(100 * kMemory) && !alarm; ++i) {
        factor.update((1 + kError) * 9.80665 + noise.next(), Newtons(kWeight));
        alarm = i % 25 == 0 && factor.estimate().wrong;
      }
      alarms += alarm ? 1 : 0;
    }
    EXPECT_LE(alarms, 0.05 * kFlights) << correlation;
  }
}

TEST(ThrustFactor, FindsAKThatIsWrongByFivePercentInTheTimeTold) {
  constexpr int kFlights = 300;
  for (const double correlation : {0.0, 0.9}) {
    for (const double wrong_by : {0.05, -0.05}) {
      for (const double good_s : {0.0, 3 * kMemory}) {
        const double told = told_seconds(wrong_by, correlation) + (good_s > 0 ? kMemory : 0);
        int found = 0, by_half = 0;
        for (unsigned seed = 0; seed < kFlights; ++seed) {
          ThrustFactor factor = fresh();
          Noise noise(seed, correlation);
          const std::size_t good = samples_of(good_s), end = good + samples_of(2 * told);
          for (std::size_t i = 0; i < end; ++i) {
            factor.update((i < good ? 1 : 1 + wrong_by) * 9.80665 + noise.next(), Newtons(kWeight));
            if (i < good || i % 5 != 0 || !factor.estimate().wrong) continue;
            ++found;
            by_half += static_cast<double>(i - good) * kPeriod < told ? 1 : 0;
            break;
          }
        }
        EXPECT_GE(found, 0.94 * kFlights) << correlation << " " << wrong_by << " " << good_s << " " << told;
        EXPECT_GE(by_half, 0.45 * kFlights) << correlation << " " << wrong_by << " " << good_s << " " << told;
      }
    }
  }
}

TEST(ThrustFactor, LeavesOutWhatIsNoMeasurementAndNeverCallsAKWrongByIt) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  const double odd[][2] = {{kNan, kWeight}, {9.8, kNan},     {kInf, kWeight}, {9.8, kInf},
                           {-kInf, -kInf},  {-9.8, kWeight}, {9.8, -kWeight}, {0, kWeight},
                           {9.8, 0},        {1e30, kWeight}, {9.8, 1e30},     {9.8, kWeight / 5}};
  ThrustFactor factor = fresh(), before = fresh();
  Noise noise(1, 0.5);
  std::uint32_t left_out = 0;
  for (std::size_t i = 0; i < samples_of(30); ++i) {
    factor.update(9.80665 + noise.next(), Newtons(kWeight));
    for (const auto& [force, told] : odd) {
      if (i % 7 != 0) continue;
      factor.update(force, Newtons(told));
      ++left_out;
    }
    ASSERT_FALSE(factor.estimate().wrong);
  }
  EXPECT_EQ(factor.left_out(), left_out);
  EXPECT_EQ(factor.used(), samples_of(30));
  EXPECT_NEAR(factor.estimate().factor, 1, 0.02);
  EXPECT_TRUE(factor.estimate().known);
  // A flood: what was known is known no longer, and comes back.
  const double last = factor.estimate().factor;
  for (std::size_t i = 0; i < samples_of(10 * kMemory); ++i) {
    factor.update(kNan, Newtons(kNan));
    ASSERT_FALSE(factor.estimate().wrong);
  }
  EXPECT_FALSE(factor.estimate().known);
  EXPECT_EQ(factor.estimate().factor, last);
  for (std::size_t i = 0; i < samples_of(10); ++i) factor.update(9.80665 + noise.next(), Newtons(kWeight));
  EXPECT_TRUE(factor.estimate().known);
  for (std::size_t i = 0; i < 5000; ++i) {
    before.update(kNan, Newtons(kInf));
    ASSERT_FALSE(before.estimate().known);
  }
}

TEST(ThrustFactor, RefusesSettingsOutsideTheirRanges) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  using Settings = ThrustFactor::Settings;
  EXPECT_TRUE(ThrustFactor::build(Settings{1, Seconds(0.01), Seconds(1), 0}));
  for (const Settings& settings :
       {Settings{0, Seconds(0.01)}, Settings{kNan, Seconds(0.01)}, Settings{1, Seconds(0)}, Settings{1, Seconds(kNan)},
        Settings{1, Seconds(0.01), Seconds(0.9)}, Settings{1, Seconds(0.01), Seconds(kNan)},
        Settings{1, Seconds(0.01), Seconds(10), -0.1}, Settings{1, Seconds(0.01), Seconds(10), 1},
        Settings{1, Seconds(0.01), Seconds(10), kNan}})
    EXPECT_FALSE(ThrustFactor::build(settings));
}

TEST(ThrustFactor, IsTheSameInC) {
  ThrustFactor factor = fresh();
  kphi_factor in_c;
  ASSERT_EQ(kphi_factor_build(&in_c, 0, kPeriod, kMemory, kError), 0);
  ASSERT_EQ(kphi_factor_build(&in_c, kMass, kPeriod, kMemory, kError), 1);
  Noise noise(3, 0.2);
  int seen = 0;
  for (int i = 0; i < 3000; ++i) {
    const double force = i % 50 == 0 ? -1 : 1.06 * 9.80665 + noise.next();
    factor.update(force, Newtons(kWeight));
    kphi_factor_update(&in_c, force, kWeight);
    double value = 0, u = 0;
    const int flags = kphi_factor_estimate(&in_c, &value, &u);
    const auto estimate = factor.estimate();
    ASSERT_EQ(value, estimate.factor);
    ASSERT_EQ(u, estimate.u);
    ASSERT_EQ(flags, (estimate.known ? KPHI_FACTOR_KNOWN : 0) + (estimate.wrong ? KPHI_FACTOR_WRONG : 0));
    seen |= flags;
  }
  EXPECT_EQ(seen, KPHI_FACTOR_KNOWN + KPHI_FACTOR_WRONG);
  unsigned used = 0, left_out = 0;
  kphi_factor_counts(&in_c, &used, &left_out);
  EXPECT_EQ(used, factor.used());
  EXPECT_EQ(left_out, 60u);
  kphi_factor_counts(&in_c, nullptr, nullptr);
}

}  // namespace thrust_factor_test
}  // namespace kphi::compensation
