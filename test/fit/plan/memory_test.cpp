#include "fit/plan/memory.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.hpp"

namespace kphi::fit {
namespace memory_test {

TEST(Memory, OfShortNoiseAveragesByTheWindowAndOfLongNoiseNotAtAll) {
  EXPECT_NEAR(averaged(4, 0) / averaged(1, 0), 1.0 / 4, 1e-12);
  EXPECT_NEAR(averaged(4, 1e-4) / averaged(1, 1e-4), 1.0 / 4, 1e-3);
  EXPECT_NEAR(averaged(4, kEndlessMemory) / averaged(1, kEndlessMemory), 1, 1e-3);
}

/// Means over windows of simulated noise, against the formula.
TEST(Memory, IsThatOfSimulatedNoise) {
  constexpr double kStep = 0.01, kMemory = 1;
  constexpr int kWindow = 100, kApart = 200, kSteps = 20000;
  Random random(1);
  const double keep = std::exp(-kStep / kMemory);
  double noise = 0, before = 0, squares = 0, products = 0;
  for (int step = 0; step < kSteps; ++step) {
    double mean = 0;
    for (int i = 0; i < kApart; ++i) {
      noise = keep * noise + std::sqrt(1 - keep * keep) * random.normal();
      if (i < kWindow) mean += noise / kWindow;
    }
    squares += mean * mean / kSteps;
    products += mean * before / kSteps;
    before = mean;
  }
  EXPECT_NEAR(squares, 2 * kMemory * averaged(1, kMemory), 0.02);
  EXPECT_NEAR(products / squares, neighbours_correlation(1, 2, kMemory), 0.02);
}

TEST(Memory, IsFoundFromHowAlikeNeighboursAre) {
  for (const double memory : {0.5, 1.0, 3.0, 30.0})
    EXPECT_NEAR(memory_of_neighbours(neighbours_correlation(1, 2, memory), 1, 2), memory, 0.01 * memory);
  EXPECT_EQ(memory_of_neighbours(0, 1, 2), 0.25);
  EXPECT_EQ(memory_of_neighbours(-0.3, 1, 2), 0.25);
  EXPECT_GT(memory_of_neighbours(1, 1, 2), 1000);
}

}  // namespace memory_test
}  // namespace kphi::fit
