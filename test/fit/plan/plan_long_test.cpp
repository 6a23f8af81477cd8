// Predicted against found: five campaigns on three stands, 200 times each.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "test/fit/plan/until_study.hpp"

namespace kphi::fit {
namespace plan_long_test {

std::vector<Wanted> told() {
  using Kind = Wanted::Kind;
  return {{Kind::thrust_coefficient, 0}, {Kind::slope, 0}, {Kind::k, 135}};
}

/// Of each of told(): predicted over found is above `least` and below 1.15.
void expect_as_predicted(const Prediction& prediction, const std::vector<Found>& found, double least,
                         const std::string& name) {
  std::string line = name;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const Budget budget = prediction.of(told()[i]);
    const double ratio = budget.combined() / found[i].scatter;
    line +=
        fmt::format("  {} {:.4f} % predicted, {:.4f} % found", found[i].name,
                    100 * budget.combined() / std::abs(budget.value), 100 * found[i].scatter / std::abs(budget.value));
    EXPECT_GT(ratio, least) << name << ", " << found[i].name;
    EXPECT_LT(ratio, 1.15) << name << ", " << found[i].name;
  }
  fmt::print("{}\n", line);
}

TEST(TwoHundredCampaigns, ScatterAsThePlanSaidWithinFifteenPercent) {
  for (const SimulatedStand& stand : stands()) {
    const StandNoise noise = piloted(stand, 60, 7000);
    int number = 0;
    for (const profiles::Campaign& campaign : designs()) {
      const Prediction prediction(campaign, noise, BenchUncertainty::none());
      const std::vector<Found> found = found_by(campaign, stand, 200, told(), 50'000);
      const std::string name = fmt::format("{:<34} campaign {}", stand.name, ++number);
      expect_as_predicted(prediction, found, 0.85, name);
    }
  }
}

// The pilots have the paper's protocol, whose steps wait 1 s for the thrust; the stand settles in 0.2 s. Where noise
// remembers 1 s, neighbours among the shorter steps are more alike than the pilots' were: the plan says 22 % too
// little.
TEST(TwoHundredCampaigns, ThatTakeNoMoreTimeThanKNeedsScatterAsThePlanSaid) {
  for (const SimulatedStand& stand : stands()) {
    StandNoise noise = piloted(stand, 60, 7000);
    noise.settle_s = kDiscard;
    for (const int repetitions : {2, 3}) {
      const profiles::Campaign campaign =
          with_until(planned_campaign({0, 45, 90, 180, 270}, repetitions, stand.mounting > 0));
      const Prediction prediction(campaign, noise, BenchUncertainty::none());
      double bench_s = 0;
      const std::vector<Found> found = found_by(campaign, stand, 200, told(), 50'000, until_certain, &bench_s);
      const double minutes = profiles::make_plan(as_expected(campaign, noise), {}).bench.value() / 60;
      // These stands need no time to come to rest.
      const double found_min = bench_s / 60 / 200 + profiles::kSpinDown.value() / 60 * repetitions *
                                                        static_cast<double>(campaign.occlusions_deg.size());
      const std::string name = fmt::format("{:<34} {} repetitions  {:.2f} min predicted, {:.2f} min found", stand.name,
                                           repetitions, minutes, found_min);
      EXPECT_NEAR(minutes, found_min, 0.15 * minutes) << stand.name;
      expect_as_predicted(prediction, found, stand.memory_s > 0 ? 0.75 : 0.85, name);
    }
  }
}

TEST(TwoHundredCampaigns, FindTheBendThatThePlanSaidTheyWould) {
  int often = 0;
  for (const SimulatedStand& stand : stands()) {
    const StandNoise noise = piloted(stand, 30, 7000);
    for (const profiles::Campaign& campaign : designs()) {
      SimulatedStand bent = stand;
      bent.bend = Prediction(campaign, noise, BenchUncertainty::none()).bend_seen();
      IdentificationOptions options;
      options.mounted_once = !campaign.order.remount_each_repetition;
      if (options.mounted_once) options.mounting = stand.mounting;
      int found = 0;
      for (std::uint64_t i = 0; i < 200; ++i)
        found += analyse(identify(simulate(campaign, bent, 900'000 + i), options)).curvature.bends() ? 1 : 0;
      fmt::print("{:<34} bend of {:.3f} % found in {} of 200\n", stand.name, 100 * bent.bend, found);
      EXPECT_GE(found, 155) << stand.name;  // two repetitions on a stand whose zeros wander
      often += found >= 190 ? 1 : 0;
    }
  }
  EXPECT_GE(often, 12) << "of 15";
}

}  // namespace plan_long_test
}  // namespace kphi::fit
