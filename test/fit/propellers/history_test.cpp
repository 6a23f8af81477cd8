#include "fit/propellers/history.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "base/random.hpp"
#include "fit/report/history_section.hpp"
#include "test/fit/bench_study.hpp"
#include "test/fit/history_study.hpp"

namespace kphi::fit {
namespace history_test {

using ::testing::HasSubstr;

/// Campaigns a week apart whose three quantities are 1 but for noise of 0.1 %, of which they know `known`.
std::vector<HistoryEntry> entries(Random& random, std::size_t n, double known = 1e-3) {
  std::vector<HistoryEntry> made;
  for (std::size_t i = 0; i < n; ++i) {
    HistoryEntry entry{fmt::format("c{}", i), fmt::format("2026-03-{:02}T10:00:00Z", 1 + 2 * i), {}};
    for (Estimate& one : entry.values) one = {1 + 1e-3 * random.normal(), known, 20};
    made.push_back(entry);
  }
  return made;
}

const Chart& stand(const std::vector<Chart>& charts) { return charts.front(); }

TEST(History, NamesTheCampaignThatStandsApart) {
  Random random(1);
  auto made = entries(random, 10);
  made[6].values[0].value += 0.008;
  const auto charts = charts_of(made);
  ASSERT_TRUE(stand(charts).change);
  EXPECT_EQ(stand(charts).change->kind, ChangeKind::one_off);
  EXPECT_EQ(stand(charts).change->at, 6u);
  EXPECT_NEAR(stand(charts).change->share, 0.008, 0.003);
  EXPECT_LT(stand(charts).limits[6], 0.006) << "its own distance does not widen the limits";
  EXPECT_NEAR(stand(charts).centre.value, 1, 0.001);
}

TEST(History, NamesTheCampaignFromWhichAllAreShifted) {
  Random random(2);
  auto made = entries(random, 10);
  for (std::size_t i = 4; i < 10; ++i) made[i].values[0].value -= 0.008;
  const auto charts = charts_of(made);
  ASSERT_TRUE(stand(charts).change);
  EXPECT_EQ(stand(charts).change->kind, ChangeKind::shift);
  EXPECT_EQ(stand(charts).change->at, 4u);
  EXPECT_NEAR(stand(charts).change->share, -0.008, 0.0015);
}

TEST(History, NamesADriftByItsWholeSize) {
  Random random(3);
  auto made = entries(random, 10);
  for (std::size_t i = 0; i < 10; ++i) made[i].values[0].value += 0.001 * static_cast<double>(i);
  const auto charts = charts_of(made);
  ASSERT_TRUE(stand(charts).change);
  EXPECT_EQ(stand(charts).change->kind, ChangeKind::drift);
  EXPECT_NEAR(stand(charts).change->share, 0.009, 0.003);
}

TEST(History, FindsTheScatterBetweenCampaignsThatTheirOwnUncertaintyDoesNotExplain) {
  Random random(4);
  double between = 0;
  for (int i = 0; i < 50; ++i) {
    auto made = entries(random, 10, 2e-4);
    between += stand(charts_of(made)).between / 50;
  }
  EXPECT_NEAR(between, 0.98e-3, 0.1e-3);
}

TEST(History, SortsByTimeAndTakesTheOrderWhereNoDateIsKnown) {
  Random random(5);
  auto made = entries(random, 6);
  std::swap(made[0], made[5]);
  (void)charts_of(made);
  EXPECT_EQ(made.front().name, "c0");
  for (std::size_t i = 0; i < 6; ++i) made[i].when.clear(), made[i].values[0].value = 1 + 0.01 * static_cast<double>(i);
  const auto charts = charts_of(made);
  ASSERT_TRUE(stand(charts).change);
  EXPECT_EQ(stand(charts).change->kind, ChangeKind::drift);
}

TEST(History, RaisesAlarmOfASteadyStandAtMostOnceInTwenty) {
  for (const double known : {1e-3, 1e-4}) {  // with honest uncertainties, and with far too small ones
    int alarms = 0;
    Random random(6);
    for (int i = 0; i < 200; ++i) {
      auto made = entries(random, 10, known);
      const auto charts = charts_of(made);
      alarms += std::ranges::any_of(charts, [](const Chart& chart) { return chart.change.has_value(); });
    }
    EXPECT_LE(alarms, 10 + 9) << known << ": 5 % of 200, and three deviations";
  }
}

TEST(History, OfWholeCampaignsNamesAShiftOfHalfAPercent) {
  const History shifted = simulated_history(10, 1, 6, 1.005, 0.001);
  EXPECT_FALSE(shifted.steady());
  EXPECT_THAT(history_text(shifted), HasSubstr("all k together: c6 of 2026-03-13 stands +0."));
  EXPECT_THAT(history_verdict(shifted), HasSubstr("The stand has changed"));
  const auto json = nlohmann::json::parse(history_json(shifted));
  EXPECT_EQ(json["charts"][0]["change"]["name"], "c6");
  EXPECT_EQ(json["charts"][0]["campaigns"].size(), 10u);
  const History steady = simulated_history(10, 1, 6, 1, 0.001);
  EXPECT_TRUE(steady.steady());
  EXPECT_THAT(history_text(steady), HasSubstr("steady: 10 campaigns"));
  EXPECT_THAT(history_figure(steady).script, HasSubstr("$chart2"));
}

TEST(History, RefusesTooFewCampaignsAndOtherPropellers) {
  std::vector<Fitted> few(2, analysed(identify(campaign_steps())));
  const std::vector<std::string> names(4, "c");
  EXPECT_THROW((void)history_of(few, names, names), ConfigurationError);
  few.resize(4, few.front());
  few[3].identification.propeller = "6x3";
  EXPECT_FALSE(of_one_propeller(few));
  EXPECT_THROW((void)history_of(few, names, names), ConfigurationError);
}

}  // namespace history_test
}  // namespace kphi::fit
