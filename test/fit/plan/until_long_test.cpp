// Campaigns that take no more time than k needs, against the paper's protocol: minutes at the stand, width of the
// intervals, coverage, and whether what the model lacks is still found.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <set>

#include "results/reduction/next_run.hpp"
#include "test/fit/plan/until_study.hpp"

namespace kphi::fit {
namespace until_long_test {

constexpr int kCampaigns = 1000;
constexpr std::size_t kMostRuns = 5;

bool while_it_moves_k(const std::vector<results::StepMean>& steps, double occlusion_deg) {
  const auto verdicts = results::judge_repetitions(steps);
  const auto& own = *std::ranges::find(verdicts, occlusion_deg, &results::RepetitionVerdict::occlusion_deg);
  return own.repetitions.size() < kMostRuns && results::moved_by_next_run(verdicts, occlusion_deg) > kUntil.k_share;
}

struct Protocol {
  const char* name;
  int repetitions;  ///< at least
  bool until, again, remounts;
};
constexpr Protocol kPaper{"paper", 3, false, false, false}, kSteps{"until", 3, true, false, false},
    kPaperRemounted{"paper, remounted", 3, false, false, true}, kRuns{"until, 2 to 5 runs", 2, true, true, true};

/// Means over the campaigns.
struct Result {
  double minutes = 0, runs = 0;
  double K_T = 0, slope = 0;  ///< half of the 95 % interval, share
  double K_T_covered = 0, slope_covered = 0, bent = 0, rose = 0;
};

/// One of the paper's four campaigns, by its place.
Result measured(SimulatedStand stand, int propeller, const Protocol& protocol, int campaigns = kCampaigns) {
  profiles::Campaign campaign = planned_campaign({0, 45, 90, 180, 270}, protocol.repetitions, protocol.remounts);
  stand.thrust = std::array{0.7, 1.0, 1.5, 2.1}.at(static_cast<std::size_t>(propeller));
  if (propeller == 3) campaign.profile.last = from_rpm(17188);
  const CampaignTruth truth;
  IdentificationOptions options;
  options.mounted_once = !protocol.remounts;
  if (options.mounted_once) options.mounting = stand.mounting;
  Result sum;
  double bench_s = 0;
  for (int i = 0; i < campaigns; ++i) {
    const HoldOfRun hold =
        protocol.until ? HoldOfRun(until_certain) : [&](const auto&) { return to_its_end(campaign, stand); };
    const auto steps = simulate(campaign, stand, 3000 + static_cast<std::uint64_t>(i), hold, &bench_s,
                                protocol.again ? AskAgain(while_it_moves_k) : AskAgain{});
    std::set<std::pair<double, int>> runs;
    for (const auto& step : steps) runs.emplace(step.occlusion_deg, step.repetition);
    AnalysisOptions known;
    known.bench = BenchUncertainty::none();
    const Analysis analysis = analyse(identify(steps, options), known);
    const Budget &K_T = analysis.coefficients.front(), &slope = analysis.line.slope;
    sum.runs += static_cast<double>(runs.size());
    sum.K_T += share_of(K_T);
    sum.slope += share_of(slope);
    sum.K_T_covered += std::abs(K_T.value - stand.thrust * truth.K_T) <= K_T.expanded();
    sum.slope_covered += std::abs(slope.value - stand.thrust * truth.slope_per_deg) <= slope.expanded();
    sum.bent += analysis.curvature.bends();
    sum.rose += std::ranges::any_of(analysis.speed, &SpeedDependence::depends);
  }
  const double n = campaigns;
  const Result mean{bench_s / 60 / n,    sum.runs / n,          sum.K_T / n,  sum.slope / n,
                    sum.K_T_covered / n, sum.slope_covered / n, sum.bent / n, sum.rose / n};
  fmt::print(
      "{:<34} {} {:<18} {:4.1f} min {:4.1f} runs  K_T ± {:.3f} % covers {:.1f} %  slope ± {:.3f} % covers {:.1f} %  "
      "bend {:.1f} %  rise {:.1f} %\n",
      stand.name, propeller, protocol.name, mean.minutes, mean.runs, 100 * mean.K_T, 100 * mean.K_T_covered,
      100 * mean.slope, 100 * mean.slope_covered, 100 * mean.bent, 100 * mean.rose);
  return mean;
}

TEST(AThousandCampaigns, OfEachPropellerKnowAsMuchInAThirdOfTheTime) {
  for (const SimulatedStand& stand : stands()) {
    for (int propeller = 0; propeller < 4; ++propeller) {
      const Result paper = measured(stand, propeller, kPaper), until = measured(stand, propeller, kSteps);
      EXPECT_LT(until.minutes, paper.minutes / 3) << stand.name;
      EXPECT_LT(until.K_T, 1.05 * paper.K_T) << stand.name;
      EXPECT_LT(until.slope, 1.05 * paper.slope) << stand.name;
      EXPECT_GT(until.K_T_covered, 0.93) << "leaving out and stopping by the data do not bias: " << stand.name;
      EXPECT_GT(until.slope_covered, 0.93) << stand.name;
      EXPECT_LT(until.K_T_covered, 0.99) << stand.name;
      EXPECT_LT(until.slope_covered, 0.99) << stand.name;
    }
  }
}

TEST(AThousandCampaigns, ThatRunAnOcclusionAgainWhileItMovesKCoverAsWell) {
  for (const SimulatedStand& stand : stands()) {
    const Result paper = measured(stand, 1, kPaperRemounted), until = measured(stand, 1, kRuns);
    EXPECT_LT(until.minutes, paper.minutes / 3) << stand.name;
    EXPECT_GT(until.K_T_covered, 0.93) << stand.name;
    EXPECT_GT(until.slope_covered, 0.93) << stand.name;
    if (stand.mounting > 0) {
      EXPECT_GT(until.runs, 15) << "mountings that scatter are repeated";
      EXPECT_LT(until.slope, paper.slope);
    } else {
      EXPECT_LT(until.runs, 12) << "a quiet stand is not";
    }
  }
}

// Where mountings scatter by 0.3 %, one mounting for each angle shows a bend of 1 % in 93 % of the campaigns, with
// either protocol: there it takes remounting.
TEST(AThousandCampaigns, StillFindABendAndARise) {
  for (SimulatedStand stand : stands()) {
    const bool remounts = stand.mounting > 0;
    Protocol until = kSteps;
    until.remounts = remounts;
    stand.bend = 0.01;
    EXPECT_GT(measured(stand, 1, until).bent, 0.95) << stand.name;
    EXPECT_GT(measured(stand, 1, kRuns).bent, 0.95) << stand.name;
    stand.bend = 0;
    stand.rise = 0.05;
    EXPECT_GT(measured(stand, 1, until).rose, 0.95) << stand.name;
    EXPECT_GT(measured(stand, 1, kRuns).rose, 0.95) << stand.name;
  }
}

}  // namespace until_long_test
}  // namespace kphi::fit
