#include "results/reduction/next_run.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.hpp"

namespace kphi::results {
namespace next_run_test {

RepetitionVerdict occlusion(double occlusion_deg, const std::vector<double>& k) {
  RepetitionVerdict verdict;
  verdict.occlusion_deg = occlusion_deg;
  for (std::size_t i = 0; i < k.size(); ++i)
    verdict.repetitions.push_back({.repetition = static_cast<int>(i) + 1, .k = k[i]});
  return verdict;
}

TEST(NextRun, MovesAMeanOfTwoAsStudentSays) {
  const std::vector one{occlusion(0, {1.01, 0.99})};
  // s = 0.01414 with one degree of freedom: 12.706 s / √6.
  EXPECT_NEAR(moved_by_next_run(one, 0), 12.706 * 0.0141421 / std::sqrt(6), 1e-4);
}

TEST(NextRun, PoolsTheScatterOfAllOcclusions) {
  const std::vector both{occlusion(0, {1.01, 0.99}), occlusion(90, {2, 2, 2, 2})};
  EXPECT_NEAR(moved_by_next_run(both, 90), 2.7764 * std::sqrt(2e-4 / 4) / std::sqrt(20), 1e-5);
  EXPECT_NEAR(moved_by_next_run(both, 0), 2.7764 * std::sqrt(2e-4 / 4) / std::sqrt(6), 1e-5);
}

TEST(NextRun, IsUnknownWithoutRepetitions) {
  EXPECT_TRUE(std::isinf(moved_by_next_run({}, 0)));
  const std::vector once{occlusion(0, {1}), occlusion(90, {1})};
  EXPECT_TRUE(std::isinf(moved_by_next_run(once, 0)));
  const std::vector other{occlusion(0, {1, 1.01}), occlusion(90, {kNotMeasured, kNotMeasured})};
  EXPECT_TRUE(std::isinf(moved_by_next_run(other, 90))) << "none of its runs has a k";
}

TEST(NextRun, MovesTheMeanNoFurtherInNineteenOfTwenty) {
  Random random(3);
  int within = 0, campaigns = 4000;
  for (int i = 0; i < campaigns; ++i) {
    std::vector<RepetitionVerdict> verdicts;
    for (const double phi : {0.0, 45.0, 90.0}) {
      std::vector<double> k;
      for (int run = 0; run < 3; ++run) k.push_back(1 + 0.003 * random.normal());
      verdicts.push_back(occlusion(phi, k));
    }
    double mean = 0;
    for (const RepetitionFigure& figure : verdicts.front().repetitions) mean += figure.k / 3;
    const double next = 1 + 0.003 * random.normal();
    within += std::abs((next - mean) / 4) <= moved_by_next_run(verdicts, 0) * mean;
  }
  EXPECT_NEAR(static_cast<double>(within) / campaigns, 0.95, 0.015);
}

}  // namespace next_run_test
}  // namespace kphi::results
