#include "fit/uncertainty/readiness.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "fit/coefficients/coefficients.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/report.hpp"
#include "test/fit/bench_study.hpp"
#include "test/fit/campaign_steps.hpp"

namespace kphi::fit {
namespace readiness_test {

using ::testing::HasSubstr;

constexpr int kCampaigns = 60, kUnwanted = -1;

/// How many of kCampaigns, every step spoiled, end with `readiness` and a doubt whose text holds `words`.
template <class Spoil>
int found_in(const StudyTruth& truth, Readiness readiness, const std::string& words, Spoil&& spoil) {
  int found = 0;
  for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
    StudyCampaign campaign = study_campaign(truth, seed);
    std::ranges::for_each(campaign.steps, spoil);
    std::erase_if(campaign.steps, [](const results::StepMean& step) { return step.repetition == kUnwanted; });
    const Identification identification = identify(campaign.steps);
    const FlightReadiness flight = analyse(identification, study_options(truth)).flight;
    const bool said = std::ranges::any_of(
        flight.doubts, [&](const Doubt& doubt) { return doubt.text.find(words) != std::string::npos; });
    found += said && flight.readiness() == readiness ? 1 : 0;
  }
  return found;
}

TEST(FlightReadiness, OfACleanCampaignIsDoubtedOnceInTwenty) {
  const auto nothing = [](results::StepMean&) {};
  const int doubted = found_in({}, Readiness::with_care, "", nothing) + found_in({}, Readiness::not_yet, "", nothing);
  EXPECT_LE(doubted, 6) << "5 % of 60 are 3; more than 6 in 60 by chance once in 40";
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
           {Readiness::with_care, "k rises with speed, by ", [](auto&) {}, 57, 0.05},
           {Readiness::with_care, "repetition 2 at 90° is",
            [](auto& step) {
              if (step.occlusion_deg == 90 && step.repetition == 2) step.thrust_n *= 0.963;  // by 10° less cover
            }},
           {Readiness::not_yet, "from 90° to 180°, but a larger occlusion",
            [](auto& step) {
              if (step.occlusion_deg == 90 || step.occlusion_deg == 180) step.occlusion_deg = 270 - step.occlusion_deg;
            }},
           {Readiness::with_care, "k(φ) is not a line",
            [](auto& step) {
              if (step.occlusion_deg == 180) step.thrust_n *= 1.02;
            }},
           {Readiness::with_care, "measured once",
            [](auto& step) {
              if (step.repetition > 1) step.repetition = kUnwanted;
            },
            kCampaigns},
       }) {
    EXPECT_GE(found_in({.rise = rise}, readiness, words, spoil), at_least) << words;
  }
}

TEST(FlightReadiness, IsNotGivenByATestThatCouldNotBeMade) {
  const auto doubts = [](std::vector<double> occlusions, const CurveOptions& curve) {
    StudyCampaign campaign = study_campaign({}, 1);
    std::erase_if(campaign.steps, [&](const results::StepMean& step) {
      return std::ranges::find(occlusions, step.occlusion_deg) == occlusions.end();
    });
    IdentificationOptions options;
    options.curve = curve;
    const FlightReadiness flight = analyse(identify(campaign.steps, options), study_options({})).flight;
    EXPECT_NE(flight.readiness(), Readiness::fit_to_fly);
    return flight.doubts.empty() ? std::string() : flight.doubts.front().text;
  };
  EXPECT_THAT(doubts({0, 90, 180}, {}), HasSubstr("is not tested: 2 occlusions carry a line of 2 numbers"));
  EXPECT_THAT(doubts({0, 90}, {.anchored = true}), HasSubstr("is not tested: 1 occlusion carry a line of"));
}

TEST(FlightReadiness, StandsAtTheTopOfScreenFileAndReport) {
  Fitted fitted = analysed(identify(campaign_steps()));
  fitted.analysis.flight = {};
  EXPECT_THAT(headline_text(fitted), ::testing::StartsWith("verdict    fit to fly\n"));
  EXPECT_THAT(format_coefficients(fitted, {}), HasSubstr("verdict: fit_to_fly\n  doubts: []\n"));
  fitted.analysis.flight.doubts = {{Readiness::not_yet, "a \"plate\" is <bent>"}};
  EXPECT_THAT(headline_text(fitted), ::testing::StartsWith("verdict    do not fly yet\n           a \"plate\" is"));
  EXPECT_THAT(format_coefficients(fitted, {}), HasSubstr("  doubts: [\"a \\\"plate\\\" is <bent>\"]\n"));
  const std::string page = format_report(fitted, {});
  EXPECT_LT(page.find("Do not fly yet"), page.find("class=\"lead\""));
  EXPECT_THAT(page, HasSubstr("is &lt;bent&gt;"));
}

}  // namespace readiness_test
}  // namespace kphi::fit
