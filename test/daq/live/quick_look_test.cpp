#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "daq/live/live_session.hpp"

namespace kphi::daq::live {
namespace quick_look_test {

TEST(QuickLook, KnowsNothingBeforeItLooked) { EXPECT_EQ(QuickLook().result().n, 0u); }

TEST(QuickLook, IsMeanThrustOverMeanSquaredSpeed) {
  QuickLook look;
  look.add(Newtons(1), RadPerSec(1000));
  look.add(Newtons(3), RadPerSec(1200));
  EXPECT_DOUBLE_EQ(look.result().k, 4.0 / (1000.0 * 1000 + 1200.0 * 1200));
  EXPECT_FALSE(std::isfinite(look.result().u_k)) << "two looks tell nothing of the scatter";
  look.begin();
  EXPECT_EQ(look.result().n, 0u);
}

TEST(QuickLook, StatesAnUncertaintyThatCoversTheTruthOfCorrelatedNoise) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  int covered = 0;
  constexpr int kSteps = 1000;
  for (int step = 0; step < kSteps; ++step) {
    QuickLook look;
    double noise = normal(random);
    for (int i = 0; i < 100; ++i) {
      noise = 0.5 * noise + std::sqrt(1 - 0.25) * normal(random);
      look.add(Newtons(1.5 + 0.05 * noise), RadPerSec(1000));
    }
    const auto seen = look.result();
    constexpr double kStudent = 2.776;  // 95 %, four degrees of freedom
    covered += std::abs(seen.k - 1.5e-6) <= kStudent * seen.u_k;
  }
  EXPECT_NEAR(covered / double(kSteps), 0.95, 0.03);
}

}  // namespace quick_look_test
}  // namespace kphi::daq::live
