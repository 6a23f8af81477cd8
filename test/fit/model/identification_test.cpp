#include "fit/model/identification.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace identification_test {

using results::QualityFlag;
using ::testing::HasSubstr;

TEST(Identification, RecoversTheTruthOfASyntheticCampaign) {
  const CampaignTruth truth;
  const Identification result = identify(campaign_steps(truth));
  ASSERT_EQ(result.table.size(), 5u);
  for (const auto& row : result.table) {
    EXPECT_NEAR(row.k, truth.k(row.phi_deg), 4 * row.standard_error) << row.phi_deg;
    EXPECT_EQ(row.repetitions, 3u);
    EXPECT_EQ(row.steps, 34u) << "40 steps less those below 3000 RPM";
    ASSERT_TRUE(row.at_speed);
    EXPECT_EQ(row.at_speed->repetitions, 3u);
    EXPECT_NEAR(row.at_speed->k, truth.k(row.phi_deg), 2e-8);
  }
  EXPECT_NEAR(result.curve_fit.value("intercept") / truth.intercept, 1, 0.003);
  EXPECT_NEAR(result.curve_fit.value("slope_per_deg") / truth.slope_per_deg, 1, 0.005);
  EXPECT_NEAR(to_rpm(RadPerSec(result.at_speed_rad_s)), 19100, 1e-6);
  EXPECT_NEAR(to_rpm(RadPerSec(result.speed_max_rad_s)), 19100, 1e-6);
  EXPECT_GT(to_rpm(RadPerSec(result.speed_min_rad_s)), 3000);
  EXPECT_EQ(result.selection.outside_range, 5u * 3u * 6u);
}

TEST(Identification, LeavesSpoiledStepsOutAndListsThem) {
  auto steps = campaign_steps({}, 3);
  const double clean = identify(steps).table[1].k;
  int spoiled = 0;
  for (auto& step : steps) {
    if (step.occlusion_deg != 45 || step.step < 20 || step.step % 3 != 0) continue;
    step.thrust_n *= 0.5;
    step.quality_flags =
        static_cast<std::uint32_t>(QualityFlag::speed_not_reached) | static_cast<std::uint32_t>(QualityFlag::derated);
    ++spoiled;
  }
  const Identification result = identify(steps);
  EXPECT_NEAR(result.table[1].k / clean, 1, 0.002);
  ASSERT_EQ(result.selection.flagged.size(), static_cast<std::size_t>(spoiled));
  EXPECT_EQ(result.selection.flagged.front().reason, "commanded speed not reached, motor derated");
  EXPECT_TRUE(result.selection.flagged.front().left_out);
}

TEST(Identification, EveryFlagSpoilsAStepButThatOfLostSamplesWhichIsOnlyListed) {
  const double clean = identify(campaign_steps()).table[0].k;
  for (const QualityFlag flag :
       {QualityFlag::speed_not_reached, QualityFlag::speed_unsteady, QualityFlag::saturated, QualityFlag::derated,
        QualityFlag::few_samples, QualityFlag::bad_status, QualityFlag::lost_samples}) {
    auto steps = campaign_steps();
    steps[39].quality_flags = static_cast<std::uint32_t>(flag);
    const StepSelection selection = select_steps(steps, {});
    const bool kept = flag == QualityFlag::lost_samples;
    EXPECT_EQ(selection.used.size(), steps.size() - (kept ? 0 : 1));
    ASSERT_EQ(selection.flagged.size(), 1u);
    EXPECT_FALSE(selection.flagged.front().reason.empty());
    EXPECT_EQ(selection.flagged.front().left_out, !kept);
    EXPECT_EQ(kept, identify(steps).table[0].k == clean);
    EXPECT_EQ(kept, selection.flagged.front().reason == "samples lost");
  }
}

TEST(Identification, DropsAveragesThatWouldCountTwice) {
  auto steps = campaign_steps();
  const double single = identify(steps).table[0].k;
  auto average = steps[39];
  average.repetition = 0;
  average.thrust_n *= 3;
  steps.push_back(average);
  EXPECT_EQ(identify(steps).table[0].k, single);
  for (auto& step : steps) step.repetition = 0;
  EXPECT_NE(identify(steps).table[0].k, single) << "where there are only averages, they are what is fitted";
}

TEST(Identification, TakesTheTopLevelThatEveryAngleReached) {
  auto steps = campaign_steps();
  for (auto& step : steps)
    if (step.occlusion_deg == 180 && step.step == 39)
      step.quality_flags = static_cast<std::uint32_t>(QualityFlag::speed_not_reached);
  const Identification result = identify(steps);
  EXPECT_NEAR(to_rpm(RadPerSec(result.at_speed_rad_s)), 100 + 19000.0 * 38 / 39, 1e-6);
  EXPECT_NEAR(result.speed_max_rad_s, result.at_speed_rad_s, 1e-9) << "the file vouches for common speeds only";
}

TEST(Identification, EvaluatesAtTheNamedSpeed) {
  IdentificationOptions options;
  options.at_speed_rad_s = from_rpm(100 + 19000.0 * 20 / 39).value();
  const Identification result = identify(campaign_steps(), options);
  EXPECT_NEAR(result.table[0].at_speed->speed_rad_s / *options.at_speed_rad_s, 1, 1e-3);
  options.at_speed_rad_s = from_rpm(50000).value();
  EXPECT_THROW((void)identify(campaign_steps(), options), FitError);
}

TEST(Identification, RefusesMixedPropellersAndEmptyTables) {
  auto steps = campaign_steps();
  steps.back().propeller = "6x2";
  EXPECT_THROW((void)identify(steps), FitError);
  EXPECT_THROW((void)identify({}), FitError);
  EXPECT_THROW((void)identify(campaign_steps(), {.speed_range = {.min_rad_s = 1e6}}), FitError);
}

TEST(Identification, NamesTheAngleThatCannotBeFitted) {
  auto steps = campaign_steps();
  std::erase_if(steps, [](const auto& s) { return s.occlusion_deg == 90 && (s.step != 39 || s.repetition != 1); });
  EXPECT_THAT([&] { (void)identify(steps); }, testing::ThrowsMessage<FitError>(HasSubstr("phi = 90 deg")));
}

TEST(Identification, OfATableKeepsTheRangeItWasGiven) {
  const std::vector<CurvePoint> points{{90, 1.2e-6, 1e-8}, {0, 1.5e-6, 1e-8}, {270, 0.4e-6, 1e-8}};
  const Identification result = identify_table(points, {.speed_range = {300, 2000}});
  EXPECT_EQ(result.table.front().phi_deg, 0);
  EXPECT_FALSE(result.table.front().fit);
  EXPECT_EQ(result.speed_max_rad_s, 2000);
}

}  // namespace identification_test
}  // namespace kphi::fit
