#include "fit/plan/prediction.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.hpp"
#include "test/fit/plan/plan_study.hpp"

namespace kphi::fit {
namespace prediction_test {

using ::testing::HasSubstr;
using Kind = Wanted::Kind;

StandNoise known_stand() {
  StandNoise noise;
  noise.noise_n = 0.002;
  noise.zero_n = 0.0005;
  noise.runs = 0.001;
  noise.mounting = 0.002;
  noise.K_T = 1.55e-6;
  noise.intercept = 1.03;
  noise.slope_per_deg = -0.00289;
  return noise;
}

double share(const profiles::Campaign& campaign, const StandNoise& noise, Kind kind, double phi_deg = 0) {
  return share_of(Prediction(campaign, noise, BenchUncertainty::none()).of({kind, phi_deg}));
}

TEST(Wishes, AreReadAsPeopleWriteThem) {
  const Wish slope = parse_wish("slope 1 %");
  EXPECT_EQ(slope.of.kind, Kind::slope);
  EXPECT_EQ(slope.share, 0.01);
  const Wish k = parse_wish(" k(135) 0.5% ");
  EXPECT_EQ(k.of.kind, Kind::k);
  EXPECT_EQ(k.of.phi_deg, 135);
  EXPECT_EQ(k.of.name(), "k(135)");
  EXPECT_EQ(parse_wish("K_T 0.2 %").of.kind, Kind::thrust_coefficient);
  EXPECT_EQ(parse_wish("k_i(90) 1 %").of.kind, Kind::scaling_factor);
  for (const char* wrong : {"", "slope", "slope 1", "slope 0 %", "slope -1 %", "k(400) 1 %", "k() 1 %", "k 1 %",
                            "T 1 %", "slope 1 % 2 %", "k(1.2.3) 1 %", "slope 1e999 %"})
    EXPECT_THROW((void)parse_wish(wrong), ConfigurationError) << wrong;
}

TEST(Prediction, GrowsMoreCertainWithEverythingThatCosts) {
  const StandNoise noise = known_stand();
  const profiles::Campaign written = planned_campaign();
  for (const Kind kind : {Kind::thrust_coefficient, Kind::slope}) {
    const double now = share(written, noise, kind);
    EXPECT_LT(share(planned_campaign({0, 45, 90, 180, 270}, 6), noise, kind), now) << "repetitions";
    EXPECT_LT(share(planned_campaign({0, 45, 90, 180, 270}, 3, true), noise, kind), now) << "remounted";
  }
  EXPECT_LT(share(written, noise, Kind::slope), share(planned_campaign({0, 90, 180, 270}), noise, Kind::slope))
      << "a lever of 225° instead of 180°, and one occlusion more";
}

TEST(Prediction, OfKTIsWhatThePaperAndPencilSay) {
  StandNoise noise = known_stand();
  noise.noise_n = noise.zero_n = 0;
  Budget K_T = Prediction(planned_campaign(), noise, BenchUncertainty::none()).of({Kind::thrust_coefficient, 0});
  EXPECT_NEAR(K_T.combined() / K_T.value, std::hypot(0.002, 0.001 / std::sqrt(3)), 1e-9) << "one mounting, three runs";
  K_T = Prediction(planned_campaign({0, 45, 90, 180, 270}, 3, true), noise, BenchUncertainty::none())
            .of({Kind::thrust_coefficient, 0});
  EXPECT_NEAR(K_T.combined() / K_T.value, std::hypot(0.002, 0.001) / std::sqrt(3), 1e-9) << "three mountings";
}

TEST(Prediction, HasTheErrorsThatNoRepetitionShows) {
  BenchUncertainty bench;
  bench.cell_calibration = 0.01;
  const Prediction prediction(planned_campaign(), known_stand(), bench);
  EXPECT_EQ(largest_row(prediction.of({Kind::thrust_coefficient, 0}))->source, "cell calibration");
  const Budget ratio = prediction.of({Kind::scaling_factor, 135});
  EXPECT_LT(share_of(ratio), 0.01) << "calibration cancels in a ratio";
  EXPECT_NEAR(ratio.value, 1.03 - 0.00289 * 135, 1e-3);
  EXPECT_THAT(prediction.of({Kind::thrust_coefficient, 0}).assumed(),
              ::testing::ElementsAre("cross-axis", "alignment", "motor clock"));
  EXPECT_THAT(ratio.assumed(), ::testing::IsEmpty()) << "they cancel, too";
  StandNoise noise = known_stand();
  noise.campaigns = 0.02;
  EXPECT_EQ(largest_row(Prediction(planned_campaign(), noise, BenchUncertainty::none()).of({Kind::k, 90}))->source,
            "campaign to campaign");
}

TEST(Prediction, SeesSmallerBendsWithMoreOcclusions) {
  const double five = Prediction(planned_campaign(), known_stand(), {}).bend_seen();
  EXPECT_GT(Prediction(planned_campaign({0, 45, 90, 270}), known_stand(), {}).bend_seen(), five);
  EXPECT_TRUE(std::isinf(Prediction(planned_campaign({0, 45, 270}), known_stand(), {}).bend_seen()));
}

TEST(AsExpected, OfAQuietStandHoldsEverySecondStepForTheShortestTime) {
  profiles::Campaign campaign = planned_campaign();
  campaign.profile.dwell = Seconds(4);
  campaign.profile.until = profiles::Until{0.002, Seconds(0.7)};
  StandNoise noise = known_stand();
  noise.settle_s = 0.2;
  noise.noise_n = 0.0005;
  const profiles::Campaign quiet = as_expected(campaign, noise);
  EXPECT_EQ(quiet.profile.steps, 21);
  EXPECT_NEAR(quiet.profile.dwell.value(), 0.7, 1e-9);
  EXPECT_FALSE(quiet.profile.until);
  noise.noise_n = 0.05;
  const profiles::Campaign loud = as_expected(campaign, noise);
  EXPECT_EQ(loud.profile.steps, 40);
  EXPECT_GT(loud.profile.dwell.value(), 1.5);
  EXPECT_EQ(as_expected(quiet, noise).profile.dwell.value(), quiet.profile.dwell.value()) << "without until as written";
}

TEST(Prediction, RefusesWhatCannotBePredicted) {
  EXPECT_THROW(Prediction(planned_campaign({45, 90, 270}), known_stand(), {}), ConfigurationError) << "no K_T";
  EXPECT_THROW(Prediction(planned_campaign(), StandNoise{}, {}), ConfigurationError) << "nothing known";
  EXPECT_THROW((void)Prediction(planned_campaign(), known_stand(), {}).of({Kind::k, 300}), ConfigurationError);
  profiles::Campaign slow = planned_campaign();
  slow.profile.last = from_rpm(2000);
  EXPECT_THROW(Prediction(slow, known_stand(), {}), ConfigurationError);
}

// The pilot's own statement, before and after.
TEST(Prediction, OfThePilotsOwnCampaignIsWhatItsFitSays) {
  const SimulatedStand& stand = stands()[0];
  const StandNoise noise = piloted(stand, 20, 1);
  const std::vector<Found> found =
      found_by(planned_campaign(), stand, 50, {{Kind::thrust_coefficient, 0}, {Kind::slope, 0}}, 1000);
  const Prediction prediction(planned_campaign(), noise, BenchUncertainty::none());
  EXPECT_NEAR(prediction.of({Kind::thrust_coefficient, 0}).combined(), found[0].stated, 0.25 * found[0].stated);
  EXPECT_NEAR(prediction.of({Kind::slope, 0}).combined(), found[1].stated, 0.25 * found[1].stated);
}

}  // namespace prediction_test
}  // namespace kphi::fit
