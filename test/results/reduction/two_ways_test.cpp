#include "results/reduction/two_ways.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <random>
#include <vector>

namespace kphi::results::two_ways_test {
using namespace testing;

constexpr double kK = 1.3e-6;
constexpr double kU = 0.002;
constexpr int kLevels = 20;

/// Up and down over 20 levels; rising, k is larger by `share`.
std::vector<StepMean> up_and_down(double share, unsigned seed = 1, bool begins_low = true) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, kU), speed(0, 1);
  std::vector<StepMean> steps;
  for (int i = 0; i < 2 * kLevels - 1; ++i) {
    const int config = i < kLevels ? i : 2 * kLevels - 2 - i;
    const int level = begins_low ? config : kLevels - 1 - config;
    const bool rises = (i < kLevels) == begins_low;
    StepMean s;
    s.step = i;
    s.commanded_speed_rad_s = 200 + 90.0 * level;
    s.speed_rad_s = s.commanded_speed_rad_s + speed(random);
    s.thrust_n = kK * (rises ? 1 + share : 1) * s.speed_rad_s * s.speed_rad_s + noise(random);
    s.thrust_u_n = kU;
    s.zero_u_n = 0;
    steps.push_back(s);
  }
  return steps;
}

TEST(Hysteresis, IsFoundWithItsSizeAndUncertainty) {
  const auto found = hysteresis_of(up_and_down(0.01));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->speeds.size(), kLevels - 1u) << "the turning point was held once";
  EXPECT_NEAR(found->share, 0.01, 3 * found->u_share);
  EXPECT_LT(found->u_share, 0.001);
  EXPECT_TRUE(found->significant());
  const auto& fastest = found->speeds.back();
  EXPECT_NEAR(fastest.up_minus_down_n, 0.01 * kK * fastest.speed_rad_s * fastest.speed_rad_s, 4 * fastest.u_n);
  EXPECT_NEAR(fastest.u_n, kU * std::sqrt(2.0), 1e-5);
  auto steps = up_and_down(0);
  for (StepMean& step : steps) step.speed_u_rad_s = 1e-3 * step.speed_rad_s, step.thrust_u_n = 0;
  const auto of_speed = hysteresis_of(steps)->speeds.front();
  EXPECT_NEAR(of_speed.u_n / (2e-3 * std::sqrt(2.0) * kK * std::pow(of_speed.speed_rad_s, 2)), 1, 0.1) << "2 u(w)/w";
}

TEST(Hysteresis, IsNotSeenWhereThereIsNoneAndItsUncertaintyIsHonest) {
  int beyond = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) beyond += hysteresis_of(up_and_down(0, seed))->significant();
  EXPECT_GE(beyond, 7) << "4.6 % of 400 by chance";
  EXPECT_LE(beyond, 32);
}

TEST(Hysteresis, IsCountedUpMinusDownAlsoWhenAProfileBeginsAtItsTop) {
  EXPECT_NEAR(hysteresis_of(up_and_down(0.01, 1, false))->share, 0.01, 0.002);
}

TEST(Hysteresis, LeavesOutFlaggedSteps) {
  auto steps = up_and_down(0);
  steps[3].thrust_n = 1e3;
  steps[3].quality_flags = static_cast<std::uint32_t>(QualityFlag::unsettled);
  const auto found = hysteresis_of(steps);
  EXPECT_EQ(found->speeds.size(), kLevels - 2u);
  EXPECT_LT(std::abs(found->share), 0.002);
}

TEST(Hysteresis, IsUnknownWithoutAWayBack) {
  auto steps = up_and_down(0);
  steps.resize(kLevels);
  EXPECT_FALSE(hysteresis_of(steps));
  EXPECT_FALSE(hysteresis_of({}));
}

TEST(Hysteresis, IsToldInOneLine) {
  EXPECT_THAT(
      hysteresis_of(up_and_down(0.01))->to_words(),
      testing::MatchesRegex("thrust going up minus going down: \\+[01]\\.[0-9]+ ± 0\\.[0-9]+ % of k; at most "
                            "\\+0\\.[0-9]+ ± 0\\.[0-9]+ N at [0-9]+ RPM; [0-9]+ of 19 speeds beyond twice their "
                            "uncertainty"));
  EXPECT_THAT(hysteresis_of(up_and_down(0, 2))->to_words(), testing::HasSubstr("no hysteresis seen"));
}

}  // namespace kphi::results::two_ways_test
