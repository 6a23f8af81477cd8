// Steps that end by themselves against the paper's of 2 s: minutes at the stand, width of the intervals, coverage.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "daq/run/step_watch.hpp"
#include "test/fit/plan/plan_study.hpp"

namespace kphi::fit {
namespace until_long_test {

constexpr int kCampaigns = 500;
constexpr double kLeast = 0.7, kMost = 4, kDiscard = 0.2, kPercent = 0.2, kRise = 0.03;  // s, s, s, %, s

/// Until the bench's own watch would end it; the thrust rises as the motor does.
Hold until_certain(const profiles::Campaign& campaign) {
  double squares = 0;
  const auto levels = campaign.profile.levels();
  for (const RadPerSec level : levels) squares += std::pow(level.value(), 4);
  return [squares, steps = levels.size()](const profiles::PlannedStep& step, double thrust_n, double zero_n,
                                          StandInTime& time) {
    const double x = step.speed.value() * step.speed.value();
    daq::StepWatch watch(kDiscard, kMost);
    HeldStep held{{}, kDiscard + StandInTime::kBin};
    double sum = 0;
    while (held.bins_n.size() < bins_in(kMost)) {
      const double since = static_cast<double>(held.bins_n.size() + 1) * StandInTime::kBin;
      held.bins_n.push_back(time.next(1).front() + thrust_n * (1 - std::exp(-since / kRise)));
      sum += held.bins_n.back();
      const auto n = held.bins_n.size();
      watch.add(since, 350 * n, sum / static_cast<double>(n));
      if (since < kLeast) continue;
      const auto [mean_n, u_n] = watch.known();
      if (u_n <= daq::good_enough_n(kPercent / 100, mean_n - zero_n, x, squares, steps)) break;
    }
    return held;
  };
}

struct Result {
  double minutes = 0;
  double K_T = 0, slope = 0;  ///< half of the 95 % interval, share, mean
  double K_T_covered = 0, slope_covered = 0;
};

Result measured(const SimulatedStand& stand, const profiles::Campaign& campaign, const Hold& hold) {
  Result result;
  const CampaignTruth truth;
  IdentificationOptions options;
  options.mounted_once = true;
  options.mounting = stand.mounting;
  double bench_s = 0;
  for (std::uint64_t i = 0; i < kCampaigns; ++i) {
    const Analysis analysis = analyse(identify(simulate(campaign, stand, 3000 + i, hold, &bench_s), options));
    const Budget &K_T = analysis.coefficients.front(), &slope = analysis.line.slope;
    result.K_T += share_of(K_T) / kCampaigns;
    result.slope += share_of(slope) / kCampaigns;
    result.K_T_covered += std::abs(K_T.value - truth.K_T) <= K_T.expanded() ? 1.0 / kCampaigns : 0;
    result.slope_covered += std::abs(slope.value - truth.slope_per_deg) <= slope.expanded() ? 1.0 / kCampaigns : 0;
  }
  result.minutes = bench_s / 60 / kCampaigns;
  return result;
}

TEST(FiveHundredCampaigns, OfStepsThatEndByThemselvesKnowAsMuchInTwoFifthsOfTheTime) {
  const profiles::Campaign campaign = planned_campaign();
  for (const SimulatedStand& stand : stands()) {
    const Result paper = measured(stand, campaign, to_its_end(campaign, stand)),
                 until = measured(stand, campaign, until_certain(campaign));
    for (const auto& [name, one] : {std::pair{"2 s", paper}, {"until", until}})
      fmt::print("{:<34} {:<6} {:4.1f} min  K_T ± {:.3f} % covers {:.1f} %  slope ± {:.3f} % covers {:.1f} %\n",
                 stand.name, name, one.minutes, 100 * one.K_T, 100 * one.K_T_covered, 100 * one.slope,
                 100 * one.slope_covered);
    EXPECT_LT(until.minutes, 0.41 * paper.minutes) << stand.name;
    EXPECT_LT(until.K_T, 1.05 * paper.K_T) << stand.name;
    EXPECT_LT(until.slope, 1.05 * paper.slope) << stand.name;
    EXPECT_GT(until.K_T_covered, paper.K_T_covered - 0.03) << "stopping by the data does not bias: " << stand.name;
    EXPECT_GT(until.slope_covered, paper.slope_covered - 0.03) << stand.name;
  }
}

}  // namespace until_long_test
}  // namespace kphi::fit
