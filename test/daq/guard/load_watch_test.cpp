#include <gtest/gtest.h>

#include <random>

#include "daq/guard/observation.hpp"
#include "test/daq/queue_bench.hpp"

namespace kphi::daq {
namespace load_watch_test {

TEST(LoadWatch, MeansThrustAndTorqueOverFiveMilliseconds) {
  LoadWatch watch({2, -1, +1}, mini40());
  for (int i = 0; i < 36; ++i) watch.add(load_of(-6, 0.25));
  EXPECT_FALSE(watch.full()) << "35 medians are 5 ms at 7 kHz; the first needs three samples";
  watch.add(load_of(-6, 0.25));
  EXPECT_TRUE(watch.full());
  EXPECT_DOUBLE_EQ(watch.thrust(), 6) << "the axis points the other way";
  EXPECT_DOUBLE_EQ(watch.shaft_torque(), 0.25);
}

TEST(LoadWatch, IsNotDeceivedByAnySingleSample) {
  std::mt19937 random(1);
  LoadWatch watch({}, mini40());
  for (int i = 0; i < 20'000; ++i) {
    const bool wild = i % 3 == 1 && random() % 4 == 0;
    watch.add(load_of(wild ? (random() % 2 ? 2000 : -2000) : 6));
    EXPECT_LE(watch.load(2), 6);
    if (watch.full()) {
      ASSERT_DOUBLE_EQ(watch.thrust(), 6);
    }
  }
}

TEST(LoadWatch, MissesNoPeakOfTwoSamplesAtAnAxis) {
  LoadWatch watch({}, mini40());
  double largest = 0;
  for (const double fz : {6, 6, 6, 70, 70, 6, 6}) {
    watch.add(load_of(fz));
    largest = std::max(largest, watch.load(2));
  }
  EXPECT_DOUBLE_EQ(largest, 70);
}

TEST(LoadWatch, SeesAJumpHalfAgainBeyondALimitWithinFourMilliseconds) {
  LoadWatch watch({}, mini40());
  for (int i = 0; i < 100; ++i) watch.add(load_of(6));
  int samples = 0;
  while (watch.thrust() <= 20) {
    watch.add(load_of(30));
    ASSERT_LT(++samples, 28);
  }
  EXPECT_GT(samples, 2);
}

TEST(LoadWatch, SmoothsTheBeatOfTheBladesAndTheNoise) {
  LoadWatch watch({}, mini40());
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.025);
  constexpr double kBladesHz = 3 * 19100.0 / 60;
  for (int i = 0; i < 70'000; ++i) {
    watch.add(load_of(6 + 0.5 * std::sin(2 * M_PI * kBladesHz * i / 7000) + noise(random)));
    if (watch.full()) {
      ASSERT_NEAR(watch.thrust(), 6, 0.1);
    }
  }
}

TEST(LoadWatch, HasAWindowOfOneSampleWhenTheyAreFew) {
  results::LoadCellScale slow = mini40();
  slow.sample_rate_hz = 100;
  LoadWatch watch({}, slow);
  for (int i = 0; i < 3; ++i) watch.add(load_of(6));
  EXPECT_TRUE(watch.full());
  watch.add(load_of(21));
  EXPECT_DOUBLE_EQ(watch.thrust(), 6);
  watch.add(load_of(21));
  EXPECT_DOUBLE_EQ(watch.thrust(), 21);
}

}  // namespace load_watch_test
}  // namespace kphi::daq
