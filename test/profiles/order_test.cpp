#include "profiles/order.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace kphi::profiles {
namespace {

using testing::ElementsAre;

const std::vector<RadPerSec> kLevels{RadPerSec(100), RadPerSec(200), RadPerSec(300), RadPerSec(400)};

std::vector<int> numbers(StepOrderKind kind, std::uint64_t seed = 0) {
  std::vector<int> numbers;
  for (const PlannedStep& step : steps_in_order(kLevels, kind, seed)) numbers.push_back(step.number);
  return numbers;
}

std::vector<double> speeds(StepOrderKind kind) {
  std::vector<double> speeds;
  for (const PlannedStep& step : steps_in_order(kLevels, kind, 0)) speeds.push_back(step.speed.value());
  return speeds;
}

TEST(StepOrder, UpIsTheProfilesOwnAndDownTheOtherWay) {
  EXPECT_THAT(speeds(StepOrderKind::up), ElementsAre(100, 200, 300, 400));
  EXPECT_THAT(numbers(StepOrderKind::up), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(speeds(StepOrderKind::down), ElementsAre(400, 300, 200, 100));
  EXPECT_THAT(numbers(StepOrderKind::down), ElementsAre(3, 2, 1, 0)) << "a level keeps its number";
}

TEST(StepOrder, UpAndDownTurnsAtTheTopOnceAndNumbersTheWayBack) {
  EXPECT_THAT(speeds(StepOrderKind::up_and_down), ElementsAre(100, 200, 300, 400, 300, 200, 100));
  EXPECT_THAT(numbers(StepOrderKind::up_and_down), ElementsAre(0, 1, 2, 3, 4, 5, 6));
}

TEST(StepOrder, ShuffledHoldsEachLevelOnceUnderItsNumber) {
  auto steps = steps_in_order(kLevels, StepOrderKind::shuffled, 3);
  EXPECT_EQ(numbers(StepOrderKind::shuffled, 3), numbers(StepOrderKind::shuffled, 3));
  std::sort(steps.begin(), steps.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
  for (std::size_t i = 0; i < kLevels.size(); ++i) {
    EXPECT_EQ(steps[i].number, static_cast<int>(i));
    EXPECT_EQ(steps[i].speed, kLevels[i]);
  }
}

TEST(StepOrder, ShuffledDiffersFromSeedToSeed) {
  int same = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed)
    same += numbers(StepOrderKind::shuffled, seed) == numbers(StepOrderKind::shuffled, 0);
  EXPECT_LT(same, 15) << "one in 24";
}

TEST(Order, IsToldInWords) {
  EXPECT_EQ(to_words(Order{}), "runs listed, steps up");
  EXPECT_EQ(to_words({RunOrderKind::shuffled, StepOrderKind::up_and_down, 7, true, true}),
            "runs shuffled, steps up_and_down (seed 7), remounted for each repetition, reference runs first and "
            "last");
}

}  // namespace
}  // namespace kphi::profiles
