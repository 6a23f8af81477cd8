#include "results/reduction/run_scatter.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

namespace kphi::results::run_scatter_test {
using namespace testing;

TEST(VarianceBetween, IsWhatTheRunsScatterBeyondTheirOwnVariance) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  std::vector<std::vector<RunShare>> occlusions(300);
  for (auto& occlusion : occlusions)
    for (int run = 0; run < 3; ++run) occlusion.push_back({1 + 0.005 * normal(random), 0.003 * 0.003});
  EXPECT_NEAR(std::sqrt(variance_between(occlusions)), 0.004, 0.0003);
  EXPECT_EQ(freedom_between(occlusions), 600);
  for (auto& occlusion : occlusions)
    for (RunShare& run : occlusion) run.variance = 1e-4;
  EXPECT_EQ(variance_between(occlusions), 0);
}

}  // namespace kphi::results::run_scatter_test
