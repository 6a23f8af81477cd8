#include "profiles/plan.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>

#include "base/error.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace plan_test {

TEST(Plan, OfThePapersCampaignHasFifteenRunsAndTwentyMinutesOfSpinning) {
  const Plan plan =
      make_plan(load_campaign(shipped("icra2021_5in_3blade.yaml")), load_bench(shipped("bench_simulated.yaml")));
  EXPECT_EQ(plan.runs.size(), 15u);
  EXPECT_EQ(plan.mountings, 15);
  EXPECT_EQ(plan.steps, 600);
  EXPECT_EQ(plan.spinning, Seconds(1200));
  EXPECT_EQ(plan.bench, Seconds(1260 + 15 * 3.5)) << "zeros, and from the last step to rest";
  EXPECT_EQ(plan.samples, 9'187'500u);
}

TEST(Plan, OfTheDemoIsWhatTheReadmeSays) {
  const Plan plan =
      make_plan(load_campaign(shipped("icra2021_5in_3blade.yaml")), load_bench(shipped("bench_simulated.yaml")));
  std::ifstream file(kphi::test::source_dir() + std::string("/README.md"));
  const std::string readme((std::istreambuf_iterator<char>(file)), {});
  EXPECT_THAT(readme,
              testing::HasSubstr(fmt::format("{} runs of {} steps", plan.runs.size(), plan.runs.front().steps.size())));
  EXPECT_THAT(readme, testing::ContainsRegex(
                          fmt::format("planned: {:.1f}[[:space:]]million", static_cast<double>(plan.samples) / 1e6)));
}

TEST(Plan, CountsTheTimeThatTheBoxesBiasTakes) {
  Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  const Seconds without = make_plan(campaign, BenchConfig{}).bench;
  campaign.box_bias = true;  // before each run measured twice for as long as a zero
  EXPECT_EQ(make_plan(campaign, BenchConfig{}).bench, without + campaign.zero * 12.0);
}

TEST(Plan, OfThePapersFourPropellersSpinsEightyMinutes) {
  Seconds spinning;
  for (const char* name : {"5in_2blade", "5in_3blade", "6in_2blade", "6in_3blade"}) {
    const auto campaign = load_campaign(shipped(std::string("icra2021_") + name + ".yaml"));
    spinning = spinning + make_plan(campaign, BenchConfig{}).spinning;
  }
  EXPECT_EQ(spinning, Seconds(80 * 60));
}

TEST(Plan, KeepsAllRepetitionsOfAMountingTogetherInTheFilesOrder) {
  Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  campaign.occlusions_deg = {90, 0};
  std::vector<std::pair<double, int>> order;
  for (const PlannedRun& run : make_plan(campaign, BenchConfig{}).runs)
    order.emplace_back(run.occlusion_deg, run.repetition);
  EXPECT_THAT(order,
              testing::ElementsAre(std::pair(90.0, 1), std::pair(90.0, 2), std::pair(0.0, 1), std::pair(0.0, 2)));
}

Campaign ordered(const std::string& order) { return parse_campaign(kCampaignText + order, "c.yaml"); }

std::vector<std::string> names(const Plan& plan) {
  std::vector<std::string> names;
  for (const PlannedRun& run : plan.runs)
    names.push_back(fmt::format("{:g}/{}{}", run.occlusion_deg, run.repetition, run.mount ? "!" : ""));
  return names;
}

TEST(Plan, ShufflesOcclusionsAsBlocksBecauseMountingIsDear) {
  std::set<std::vector<double>> orders;
  for (int seed = 1; seed <= 50; ++seed) {
    const Plan plan = make_plan(ordered(fmt::format("order: {{runs: shuffled, seed: {}}}\n", seed)), BenchConfig{});
    EXPECT_EQ(plan.mountings, 3);
    for (std::size_t i = 0; i < plan.runs.size(); ++i) {
      EXPECT_EQ(plan.runs[i].repetition, 1 + static_cast<int>(i % 2));
      EXPECT_EQ(plan.runs[i].mount, i % 2 == 0);
    }
    orders.insert(plan.mounting_angles());
  }
  EXPECT_EQ(orders.size(), 6u) << "all orders of three occlusions come up";
}

TEST(Plan, ShufflesAllRunsWhenEachIsMountedAnewAndNumbersRepetitionsAsTheyAreRun) {
  const Plan plan =
      make_plan(ordered("order: {runs: shuffled, seed: 5, remount_each_repetition: true}\n"), BenchConfig{});
  EXPECT_EQ(plan.mountings, 6);
  std::map<double, int> last;
  int blocks = 0;
  for (std::size_t i = 0; i < plan.runs.size(); ++i) {
    EXPECT_TRUE(plan.runs[i].mount);
    EXPECT_EQ(plan.runs[i].repetition, ++last[plan.runs[i].occlusion_deg]);
    blocks += i == 0 || plan.runs[i].occlusion_deg != plan.runs[i - 1].occlusion_deg;
  }
  EXPECT_THAT(last, testing::ElementsAre(testing::Pair(0, 2), testing::Pair(45, 2), testing::Pair(90, 2)));
  EXPECT_GT(blocks, 3) << "repetitions of an occlusion are no longer together";
}

TEST(Plan, IsTheSameFromTheSameSeedAndIsWrittenDownHere) {
  EXPECT_THAT(names(make_plan(ordered("order: {runs: shuffled, seed: 2021}\n"), BenchConfig{})),
              testing::ElementsAre("0/1!", "0/2", "90/1!", "90/2", "45/1!", "45/2"));
}

TEST(Plan, HasAReferenceRunAtBothEndsThatIsNoRepetition) {
  EXPECT_THAT(names(make_plan(ordered("order: {reference: true}\n"), BenchConfig{})),
              testing::ElementsAre("0/-1!", "0/1", "0/2", "45/1!", "45/2", "90/1!", "90/2", "0/-2!"));
  Campaign campaign = ordered("order: {reference: true}\n");
  campaign.occlusions_deg = {90};
  EXPECT_THAT(names(make_plan(campaign, BenchConfig{})), testing::ElementsAre("0/-1!", "90/1!", "90/2", "0/-2!"));
}

TEST(Plan, ShufflesTheStepsOfEachRunByItsOwnSeed) {
  const Plan plan = make_plan(ordered("order: {steps: shuffled, seed: 6}\n"), BenchConfig{});
  const Plan again = make_plan(ordered("order: {runs: shuffled, steps: shuffled, seed: 6}\n"), BenchConfig{});
  std::map<std::pair<double, int>, std::vector<int>> orders;
  const auto numbers = [](const PlannedRun& run) {
    std::vector<int> found;
    for (const PlannedStep& step : run.steps) found.push_back(step.number);
    return found;
  };
  std::set<std::vector<int>> different;
  for (const PlannedRun& run : plan.runs) {
    orders[{run.occlusion_deg, run.repetition}] = numbers(run);
    different.insert(numbers(run));
  }
  EXPECT_GT(different.size(), 3u);
  for (const PlannedRun& run : again.runs) {
    const auto order = orders.at({run.occlusion_deg, run.repetition});
    EXPECT_EQ(numbers(run), order) << "whatever else the campaign holds";
  }
}

TEST(Plan, CountsTheStepsOfTheWayBackAndTheTimeOfRamps) {
  EXPECT_EQ(make_plan(ordered("order: {steps: up_and_down}\n"), BenchConfig{}).steps, 6 * 7);
  const std::string slew = changed(kCampaignText, "last_rpm: 19100\n", "last_rpm: 19100\n  slew_rpm_s: 1910\n");
  const Plan plain = make_plan(parse_campaign(kCampaignText, "c.yaml"), BenchConfig{});
  const Plan up = make_plan(parse_campaign(slew, "c.yaml"), BenchConfig{});
  EXPECT_NEAR((up.spinning - plain.spinning).value(), 6 * 10.0, 1e-6) << "0 to 19100 RPM by 1910 RPM/s, six times";
  EXPECT_NEAR((up.bench - plain.bench).value(), 6 * 10.0, 1e-6);
  EXPECT_EQ(up.samples - plain.samples, 60u * 7000);
  const Plan both = make_plan(parse_campaign(slew + "order: {steps: up_and_down}\n", "c.yaml"), BenchConfig{});
  EXPECT_NEAR((both.spinning - plain.spinning).value(), 6 * (3 * 2 + 10 + 19000 / 1910.0), 1e-6);
}

TEST(Plan, CountsSamplesAtTheBenchsRate) {
  const Campaign campaign = parse_campaign(kCampaignText, "c.yaml");         // 6 runs of 4 steps of 2 s, zeros of 3 s
  const Plan plan = make_plan(campaign, parse_bench(kBenchText, "b.yaml"));  // 3500 Hz
  EXPECT_EQ(plan.samples, 6u * (2 * (8 + 6) + 7) * 3500 / 2) << "3.5 s to rest after each";
}

TEST(Plan, IsRefusedOnABenchWhoseMotorOrStandMayNotTurnSoFast) {
  const auto refusal = [](const std::string& campaign, const std::string& bench) -> std::string {
    try {
      require_within(parse_campaign(campaign, "c.yaml"), parse_bench(bench, "b.yaml"));
    } catch (const ConfigurationError& error) {
      return error.what();
    }
    return "";
  };
  const std::string slow = changed(kBenchText, "19300", "18000");
  EXPECT_EQ(
      refusal(kCampaignText, slow),
      "c.yaml:15:13: profile.last_rpm: 19100 RPM is above 18000 RPM, the bench's iq.speed_max_rpm (b.yaml:15:18); "
      "lower the profile or choose another bench");
  const auto downwards = changed(kCampaignText, "first_rpm: 100", "first_rpm: 19000");
  EXPECT_THAT(refusal(changed(downwards, "last_rpm: 19100", "last_rpm: 100"), slow),
              testing::StartsWith("c.yaml:14:14: profile.first_rpm: 19000 RPM"));
  EXPECT_THAT(refusal(kCampaignText, std::string(kBenchText) + "limits: {speed_max_rpm: 18000}\n"),
              testing::HasSubstr("above 18000 RPM, the bench's limits.speed_max_rpm (b.yaml:21:25)"));
  EXPECT_EQ(refusal(kCampaignText, changed(kBenchText, "19300", "19100")), "") << "the motor's limit itself";
}

TEST(Plan, IsRefusedWithoutPlacesIfTheFilesTextsAreUnknown) {
  Campaign campaign;
  campaign.path = "c.yaml";
  campaign.profile.last = from_rpm(100);
  BenchConfig bench;
  bench.path = "b.yaml";
  bench.iq.speed_max = from_rpm(50);
  EXPECT_THAT([&] { require_within(campaign, bench); }, testing::ThrowsMessage<ConfigurationError>(testing::StartsWith(
                                                            "c.yaml: profile.last_rpm: 100 RPM is above 50 RPM")));
}

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

}  // namespace plan_test
}  // namespace kphi::profiles
