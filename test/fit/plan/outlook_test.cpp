#include "fit/plan/outlook.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "test/fit/plan/plan_study.hpp"

namespace kphi::fit {
namespace outlook_test {

using ::testing::HasSubstr;
using ::testing::Not;

const SimulatedStand kStand{.name = "", .noise_n = 0.002, .runs = 0.001};

std::vector<results::StepMean> first_runs(const profiles::Campaign& campaign, int runs, std::uint64_t seed = 1) {
  const auto all = simulate(campaign, kStand, seed);
  const std::size_t per_run = static_cast<std::size_t>(campaign.profile.steps);
  return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(per_run * static_cast<std::size_t>(runs))};
}

std::string words_after(int runs, std::vector<std::string> wishes = {}) {
  std::vector<Wish> wanted;
  for (const std::string& text : wishes) wanted.push_back(parse_wish(text));
  const profiles::Campaign campaign = planned_campaign();
  return to_words(reached_so_far(first_runs(campaign, runs), campaign, BenchUncertainty::none(), wanted));
}

TEST(Outlook, SaysMoreWithEveryRun) {
  EXPECT_EQ(words_after(0), "");
  EXPECT_THAT(words_after(3), HasSubstr("so far K_T ± 0."));
  EXPECT_THAT(words_after(3), Not(HasSubstr("slope"))) << "no occlusion yet";
  EXPECT_THAT(words_after(9), HasSubstr("slope ± "));
  EXPECT_THAT(words_after(9), HasSubstr("; the plan ends at 0."));
  EXPECT_THAT(words_after(9), HasSubstr(" in 9 min"));
  EXPECT_THAT(words_after(15), Not(HasSubstr("the plan ends"))) << "it has";
}

TEST(Outlook, OfStepsThatEndByThemselvesCountsThemAsTheyWere) {
  profiles::Campaign campaign = planned_campaign();
  const auto steps = first_runs(campaign, 9);  // of 2 s
  campaign.profile.until = profiles::Until{0.002, Seconds(0.7)};
  campaign.profile.dwell = Seconds(20);
  EXPECT_THAT(to_words(reached_so_far(steps, campaign, BenchUncertainty::none(), {})), HasSubstr(" in 9 min"));
}

TEST(Outlook, TellsHowFarItIsToAWish) {
  EXPECT_THAT(words_after(15, {"slope 5 %"}), HasSubstr("of 5.00 % wanted"));
  EXPECT_THAT(words_after(15, {"slope 5 %"}), Not(HasSubstr("more than planned")));
  EXPECT_THAT(words_after(15, {"slope 0.15 %"}), HasSubstr("slope ± 0.15 % takes "));
  EXPECT_THAT(words_after(15, {"slope 0.01 %"}), HasSubstr("takes over 10 repetitions more than planned"));
  EXPECT_THAT(words_after(15, {"k(135) 1 %"}), HasSubstr("so far k(135) ± 0."));
}

TEST(Outlook, OfOneMoreRepetitionIsBetterByTheRootOfTheirNumber) {
  constexpr unsigned kCampaigns = 12;
  const profiles::Campaign campaign = planned_campaign();
  IdentificationOptions options;
  options.mounted_once = true;
  options.mounting = 0;
  AnalysisOptions known;
  known.bench = BenchUncertainty::none();
  double ratio = 0;
  for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
    Identification identification = identify(simulate(campaign, kStand, seed), options);
    Analysis analysis = analyse(identification, known);
    const Fitted fitted{std::move(identification), std::move(analysis)};
    const auto more = one_more_repetition(fitted, campaign, {}, BenchUncertainty::none());
    ASSERT_TRUE(more);
    EXPECT_NEAR(more->minutes, 5 * 87.5 / 60, 1e-9) << "five runs of 84 s, and 3.5 s to rest";
    EXPECT_EQ(more->mountings, 5);
    ASSERT_EQ(more->numbers.size(), 2u);
    ratio += *more->numbers[0].then / more->numbers[0].now / kCampaigns;
    EXPECT_THAT(to_words(*more), HasSubstr("repetition of each occlusion (7.3 min, 5 mountings): K_T ± "));
    EXPECT_EQ(to_json(*more)["numbers"][1]["quantity"], "slope");
  }
  EXPECT_NEAR(ratio, 0.956 * std::sqrt(3.0 / 4), 0.06)
      << "with Student's factor of 15 degrees of freedom over that of 10";
}

TEST(Outlook, OfASingleRepetitionIsNotKnown) {
  const profiles::Campaign once = planned_campaign({0, 45, 90, 180, 270}, 1);
  EXPECT_FALSE(one_more_repetition(analysed(identify(simulate(once, kStand, 1))), once, {}, {}));
}

TEST(Outlook, SurvivesStepsOfAnyKind) {
  const profiles::Campaign campaign = planned_campaign();
  auto steps = first_runs(campaign, 6);
  for (results::StepMean& step : steps)
    step.quality_flags = static_cast<std::uint32_t>(results::QualityFlag::saturated);
  EXPECT_EQ(to_words(reached_so_far(steps, campaign, {}, {})), "");
  for (results::StepMean& step : steps) step.quality_flags = 0, step.thrust_n = std::nan("");
  EXPECT_NO_THROW((void)to_words(reached_so_far(steps, campaign, {}, {})));
  for (results::StepMean& step : steps) step.thrust_n = -1;
  EXPECT_NO_THROW((void)to_words(reached_so_far(steps, campaign, {}, {})));
}

}  // namespace outlook_test
}  // namespace kphi::fit
