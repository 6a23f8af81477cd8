#include "profiles/plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "profiles/configuration_error.hpp"
#include "test/profiles/refusals.hpp"

namespace kphi::profiles {
namespace {

TEST(Plan, OfThePapersCampaignHasFifteenRunsAndTwentyMinutesOfSpinning) {
  const Plan plan =
      make_plan(load_campaign(shipped("icra2021_5in_3blade.yaml")), load_bench(shipped("bench_simulated.yaml")));
  EXPECT_EQ(plan.runs.size(), 15u);
  EXPECT_EQ(plan.mountings, 5);
  EXPECT_EQ(plan.steps, 600);
  EXPECT_EQ(plan.spinning, Seconds(1200));
  EXPECT_EQ(plan.bench, Seconds(1260));
  EXPECT_EQ(plan.samples_in_steps, 8'400'000u);
  EXPECT_EQ(plan.samples, 8'820'000u);
  EXPECT_EQ(plan.bytes, 388'080'000u);
}

TEST(Plan, CountsTheTimeThatTheBoxesBiasTakes) {
  Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  const Seconds without = make_plan(campaign, Bench{}).bench;
  campaign.box_bias = true;  // before each run measured twice for as long as a zero
  EXPECT_EQ(make_plan(campaign, Bench{}).bench, without + campaign.zero * 12.0);
}

TEST(Plan, OfThePapersFourPropellersSpinsEightyMinutes) {
  Seconds spinning;
  for (const char* name : {"5in_2blade", "5in_3blade", "6in_2blade", "6in_3blade"}) {
    const auto campaign = load_campaign(shipped(std::string("icra2021_") + name + ".yaml"));
    spinning = spinning + make_plan(campaign, Bench{}).spinning;
  }
  EXPECT_EQ(spinning, Seconds(80 * 60));
}

TEST(Plan, KeepsAllRepetitionsOfAMountingTogetherInTheFilesOrder) {
  Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  campaign.occlusions_deg = {90, 0};
  std::vector<std::pair<double, int>> order;
  for (const PlannedRun& run : make_plan(campaign, Bench{}).runs) order.emplace_back(run.occlusion_deg, run.repetition);
  EXPECT_THAT(order,
              testing::ElementsAre(std::pair(90.0, 1), std::pair(90.0, 2), std::pair(0.0, 1), std::pair(0.0, 2)));
}

TEST(Plan, CountsSamplesAtTheBenchsRate) {
  const Campaign campaign = parse_campaign(kCampaignText, "c.yaml");         // 6 runs of 4 steps of 2 s, zeros of 3 s
  const Plan plan = make_plan(campaign, parse_bench(kBenchText, "b.yaml"));  // 3500 Hz
  EXPECT_EQ(plan.samples_in_steps, 6u * 8 * 3500);
  EXPECT_EQ(plan.samples, 6u * (8 + 6) * 3500);
}

TEST(Plan, IsRefusedOnABenchWhoseMotorMayNotTurnSoFast) {
  const Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  const Bench bench = parse_bench(changed(kBenchText, "19300", "18000"), "b.yaml");
  EXPECT_THAT(
      [&] { require_within(campaign, bench); },
      testing::ThrowsMessage<ConfigurationError>(
          "c.yaml:15:13: profile.last_rpm: 19100 RPM is above 18000 RPM, the motor's iq.speed_max_rpm (b.yaml:15:18); "
          "lower the profile or choose another bench"));
}

TEST(Plan, IsRefusedForItsFirstSpeedWhereThatIsTheTop) {
  auto text = changed(kCampaignText, "first_rpm: 100", "first_rpm: 19000");
  text = changed(text, "last_rpm: 19100", "last_rpm: 100");
  const Bench bench = parse_bench(changed(kBenchText, "19300", "18000"), "b.yaml");
  EXPECT_THAT(
      [&] { require_within(parse_campaign(text, "c.yaml"), bench); },
      testing::ThrowsMessage<ConfigurationError>(testing::StartsWith("c.yaml:14:14: profile.first_rpm: 19000 RPM")));
}

TEST(Plan, MayReachTheMotorsLimitItself) {
  const Campaign campaign = parse_campaign(kCampaignText, "c.yaml");
  EXPECT_NO_THROW(require_within(campaign, parse_bench(changed(kBenchText, "19300", "19100"), "b.yaml")));
}

TEST(Plan, IsRefusedWithoutPlacesIfTheFilesTextsAreUnknown) {
  Campaign campaign;
  campaign.path = "c.yaml";
  campaign.profile.last = from_rpm(100);
  Bench bench;
  bench.path = "b.yaml";
  bench.iq.speed_max = from_rpm(50);
  EXPECT_THAT([&] { require_within(campaign, bench); }, testing::ThrowsMessage<ConfigurationError>(testing::StartsWith(
                                                            "c.yaml: profile.last_rpm: 100 RPM is above 50 RPM")));
}

}  // namespace
}  // namespace kphi::profiles
