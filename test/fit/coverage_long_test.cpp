// The statement about intervals, by a thousand campaigns.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "test/fit/bench_study.hpp"
#include "test/fit/zero_study.hpp"

namespace kphi::fit {
namespace coverage_long_test {

TEST(ThousandCampaigns, IntervalsCoverTheTruthAsOftenAsTheySay) {
  for (const auto& [quantity, coverage] : coverage_study({}, 1000)) {
    fmt::print("{:<28} {:5.1f} %, bias {:+.3f} u\n", quantity, coverage.share(), coverage.bias());
    EXPECT_GE(coverage.share(), 93) << quantity;
    EXPECT_LE(coverage.share(), 98.5) << quantity;
    EXPECT_LT(std::abs(coverage.bias()), 0.2) << quantity;
  }
}

TEST(ThousandCampaigns, ABentTruthIsReported) {
  const BentCount found = count_bent(bent_truth(), 1000);
  fmt::print("bend found in {} of 1000\n", found.line);
  EXPECT_GE(found.line, 950);
  for (const auto& [phi_deg, times] : found.speed) {
    fmt::print("rise at {:3} deg found in {}\n", phi_deg, times);
    EXPECT_GE(times, 950) << phi_deg;
  }
}

TEST(ThousandCampaigns, AStraightTruthIsCalledBentInOneOfTwenty) {
  const BentCount found = count_bent({}, 1000);
  const double line = 0.1 * found.line_lack_of_fit, lack = 0.02 * found.lack_of_fit, trend = 0.02 * found.trend;
  fmt::print("called bent: line {:.1f} %, lack of fit {:.1f} %, trend {:.1f} %\n", line, lack, trend);
  for (const double percent : {line, lack, trend}) {
    EXPECT_GE(percent, 3);
    EXPECT_LE(percent, 7);
  }
}

// A share of 95 % has a deviation of 0.7 % in a thousand: 94 % less two of them. Many cover more than 97 %: part of ±
// is what the tests of the model find by chance. The error of one jump in a campaign is not normal.
TEST(ThousandCampaigns, CoverOnEightStands) {
  for (const ScatteringStand& stand : scattering_stands()) {
    fmt::print("{:<28}", stand.name);
    for (const auto& [quantity, found] : scatter_study(stand, 1000)) {
      EXPECT_GE(found.share(), 92.6) << stand.name << ", " << quantity;
      if (quantity == "number of the verdict") {
        fmt::print(" {} ({:.1f} %) holds in {:.1f} %", quantity, 100 * found.expanded / found.n, found.share());
        EXPECT_GE(found.share(), 95) << stand.name;
        continue;
      }
      fmt::print(" {} {:.1f} % {:.2f}", quantity, found.share(), found.u_over_scatter());
      if (stand.one_jump_n > 0) continue;
      EXPECT_LE(found.share(), 99.3) << stand.name << ", " << quantity;
      EXPECT_GE(found.u_over_scatter(), 0.90) << stand.name << ", " << quantity;
      EXPECT_LE(found.u_over_scatter(), 1.16) << stand.name << ", " << quantity;
    }
    fmt::print("\n");
  }
}

// "Fit to fly" says that the thrust is within 3 % at 95 %. No stand but the bent one is further off in 5 of 100
// campaigns or more. The number of one with errors as they are assumed is 2.3 % and scatters: beyond 3 % in 6 of 100.
TEST(ThousandCampaigns, AreWithCareWhereItIsDeserved) {
  constexpr unsigned kCampaigns = 1000;
  struct Stand {
    const char* name;
    StudyTruth truth;
    unsigned least_care, most_care;
  };
  StudyTruth assumed = without_kink();
  assumed.between_runs = 0.005;
  assumed.calibration = std::hypot(0.006, 0.002, 0.0009);
  assumed.clock = 0.002;
  StudyTruth bent = assumed;
  bent.bend = 0.04;
  for (const auto& [name, truth, least_care, most_care] :
       {Stand{"quiet", without_kink(), 0, 50}, {"assumed sizes", assumed, 0, 80}, {"bent", bent, 950, 1000}}) {
    unsigned wrong = 0, care = 0, held = 0;
    double told = 0;
    for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
      const StudyCampaign campaign = study_campaign(truth, 50000 + seed);
      Identification found = identify(campaign.steps);
      Analysis analysis = analyse(found, study_options(truth));
      const Fitted fitted{std::move(found), std::move(analysis)};
      const double air = campaign.density / kStandardDensity;
      const double error = true_error(
          fitted, [&, &truth = truth](double phi, double) { return std::min(truth.k(0), truth.k(phi)) * air; });
      const FlightReadiness& flight = fitted.analysis.flight;
      wrong += error > flight.limits.fit_to_fly ? 1 : 0;
      care += flight.readiness() != Readiness::fit_to_fly ? 1 : 0;
      held += error <= flight.error.share ? 1 : 0;
      told += flight.error.share / kCampaigns;
    }
    fmt::print("{:<14} {} of {} are more than 3 % wrong, {} with care or less; number {:.2f} %, holds in {}\n", name,
               wrong, kCampaigns, care, 100 * told, held);
    EXPECT_GE(held, 0.936 * kCampaigns) << name;
    EXPECT_GE(care, least_care) << name;
    EXPECT_LE(care, most_care) << name;
  }
}

}  // namespace coverage_long_test
}  // namespace kphi::fit
