#include "fit/uncertainty/readiness.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "fit/coefficients/coefficients.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/report.hpp"
#include "test/fit/bench_study.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace readiness_test {

using ::testing::HasSubstr;

constexpr int kCampaigns = 60, kUnwanted = -1;

FlightReadiness flight_of(const StudyCampaign& campaign, const StudyTruth& truth, const CurveOptions& curve = {}) {
  IdentificationOptions options;
  options.curve = curve;
  return analyse(identify(campaign.steps, options), study_options(truth)).flight;
}

bool says(const FlightReadiness& flight, const std::string& words) {
  return std::ranges::any_of(flight.doubts,
                             [&](const Doubt& doubt) { return doubt.text.find(words) != std::string::npos; });
}

/// How many of kCampaigns, every step spoiled, end with a doubt whose text holds `words` and at least `readiness`.
template <class Spoil>
int found_in(const StudyTruth& truth, Readiness readiness, const std::string& words, Spoil&& spoil) {
  int found = 0;
  for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
    StudyCampaign campaign = study_campaign(truth, seed);
    std::ranges::for_each(campaign.steps, spoil);
    std::erase_if(campaign.steps, [](const results::StepMean& step) { return step.repetition == kUnwanted; });
    const FlightReadiness flight = flight_of(campaign, truth);
    found += says(flight, words) && flight.readiness() >= readiness ? 1 : 0;
  }
  return found;
}

TEST(FlightReadiness, OfACleanCampaignIsDoubtedOnceInTwenty) {
  int doubted = 0, flies = 0;
  const StudyTruth truth = without_kink();
  for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
    const FlightReadiness flight = flight_of(study_campaign(truth, seed), truth);
    doubted += flight.doubts.empty() ? 0 : 1;
    flies += flight.readiness() == Readiness::fit_to_fly ? 1 : 0;
  }
  EXPECT_LE(doubted, 6) << "5 % of 60 are 3; more than 6 in 60 by chance once in 40";
  EXPECT_GE(flies, 57);
}

TEST(FlightReadiness, SaysWhatIsWrongWithACampaign) {
  struct Case {
    Readiness readiness;
    const char* words;
    std::function<void(results::StepMean&)> spoil;
    int at_least = 57;
    double rise = 0;
  };
  for (const auto& [readiness, words, spoil, at_least, rise] : std::vector<Case>{
           {Readiness::fit_to_fly, "k rises with speed, by ", [](auto&) {}, 57, 0.05},
           {Readiness::with_care, "repetition 2 at 90° is",
            [](auto& step) {
              if (step.occlusion_deg == 90 && step.repetition == 2) step.thrust_n *= 0.963;  // by 10° less cover
            }},
           {Readiness::not_yet, "from 90° to 180°, but a larger occlusion",
            [](auto& step) {
              if (step.occlusion_deg == 90 || step.occlusion_deg == 180) step.occlusion_deg = 270 - step.occlusion_deg;
            }},
           {Readiness::fit_to_fly, "k(φ) is not a line",
            [](auto& step) {
              if (step.occlusion_deg == 180) step.thrust_n *= 1.02;
            }},
           {Readiness::not_yet, "if a plate was on at 0°, K_T is 1",
            [truth = StudyTruth()](auto& step) {
              if (step.occlusion_deg == 0) step.thrust_n *= truth.k(45) / truth.k(0);
            }},
           {Readiness::not_yet, "times the power that the torque gives", [](auto& step) { step.torque_nm *= 0.1; },
            kCampaigns},
           {Readiness::not_yet, "makes C_T =", [](auto& step) { step.thrust_n *= 9.81; }, kCampaigns},
       }) {
    EXPECT_GE(found_in({.rise = rise}, readiness, words, spoil), at_least) << words;
  }
}

TEST(FlightReadiness, IsBoundByWhatNoTestCouldLookAt) {
  const auto of = [](std::vector<double> occlusions, const CurveOptions& curve) {
    StudyCampaign campaign = study_campaign({}, 1);
    std::erase_if(campaign.steps, [&](const results::StepMean& step) {
      return std::ranges::find(occlusions, step.occlusion_deg) == occlusions.end();
    });
    return flight_of(campaign, {}, curve);
  };
  for (const FlightReadiness& flight : {of({0, 90, 180}, {}), of({0, 90}, {.anchored = true})}) {
    EXPECT_EQ(flight.readiness(), Readiness::not_yet);
    EXPECT_GT(flight.error.share, 0.2) << "anywhere between the k at both ends, as long as it falls";
    EXPECT_TRUE(says(flight, "k(φ) between the occlusions is not tested"));
  }
}

TEST(FlightReadiness, FollowsTheNumberAndItsLimits) {
  FlightReadiness flight;
  flight.error.share = 0.021;
  EXPECT_EQ(flight.readiness(), Readiness::fit_to_fly);
  flight.limits.fit_to_fly = 0.02;
  EXPECT_EQ(flight.readiness(), Readiness::with_care);
  flight.error.share = 0.11;
  EXPECT_EQ(flight.readiness(), Readiness::not_yet);
  flight.error.share = std::nan("");
  EXPECT_EQ(flight.readiness(), Readiness::with_care) << "unknown is not small";
}

TEST(FlightReadiness, StandsAtTheTopOfScreenFileAndReport) {
  Fitted fitted = analysed(identify(campaign_steps()));
  fitted.analysis.flight = {.error = {0.0142, 45, {{"mounting", 0.01, "mount each repetition anew"}}}};
  EXPECT_THAT(headline_text(fitted),
              ::testing::StartsWith("verdict    fit to fly: thrust within 1.4 % (95 %), most of it mounting, 1 %: "
                                    "mount each repetition anew\n"));
  EXPECT_THAT(format_coefficients(fitted, {}), HasSubstr("verdict: fit_to_fly\n  doubts: []\n"));
  fitted.analysis.flight.doubts = {{Readiness::not_yet, "a \"plate\" is <bent>"}};
  EXPECT_THAT(headline_text(fitted),
              ::testing::StartsWith("verdict    do not fly yet: not counting what is said below, thrust"));
  EXPECT_THAT(headline_text(fitted), HasSubstr("\n           a \"plate\" is"));
  EXPECT_THAT(format_coefficients(fitted, {}), HasSubstr("  doubts: [\"a \\\"plate\\\" is <bent>\"]\n"));
  const std::string page = format_report(fitted, {});
  EXPECT_LT(page.find("Do not fly yet"), page.find("class=\"lead\""));
  EXPECT_THAT(page, HasSubstr("is &lt;bent&gt;"));
}

}  // namespace readiness_test
}  // namespace kphi::fit
