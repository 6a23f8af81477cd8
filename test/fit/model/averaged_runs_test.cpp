// means.csv is to give the k of steps.csv, and as honest a ±.
#include "fit/model/averaged_runs.hpp"

#include <gtest/gtest.h>

#include <map>

#include "results/reduction/step_averages.hpp"
#include "results/steps_csv.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace averaged_runs_test {

using results::StepMean;

/// Steps of a study; each run tells how far its zero moved, as those of kphi do.
std::vector<StepMean> study_steps(const StudyTruth& truth, unsigned seed) {
  std::vector<StepMean> steps = study_campaign(truth, seed).steps;
  std::map<std::pair<double, int>, std::pair<double, double>> zeros;
  for (const StepMean& step : steps) {
    auto& [first, last] =
        zeros.try_emplace({step.occlusion_deg, step.repetition}, step.zero_n, step.zero_n).first->second;
    last = step.zero_n;
  }
  for (StepMean& step : steps) {
    const auto& [first, last] = zeros.at({step.occlusion_deg, step.repetition});
    step.zero_moved_n = last - first;
    step.zero_u_n = 0.001;
    step.discarded_s = 1;  // or the table has no such columns
  }
  return steps;
}

/// As a file holds them.
std::vector<StepMean> means_in_a_file(const std::vector<StepMean>& steps) {
  return results::parse_steps(results::format_steps(results::means_of(steps)), "means.csv");
}

TEST(AveragedRuns, GiveTheSameKWhereAllRepetitionsRanAtTheSameSpeeds) {
  auto steps = study_steps({}, 3);
  for (StepMean& step : steps) step.speed_rad_s = step.commanded_speed_rad_s;
  const auto means = means_in_a_file(steps);
  ASSERT_EQ(3 * means.size(), steps.size());
  for (const Estimator estimator :
       {Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed}) {
    const Identification one = identify(steps, {.estimator = estimator}),
                         other = identify(means, {.estimator = estimator});
    for (std::size_t i = 0; i < one.table.size(); ++i) {
      EXPECT_NEAR(other.table[i].k / one.table[i].k, 1, 1e-12) << name_of(estimator);
      EXPECT_EQ(other.table[i].repetitions, 3u);
    }
  }
}

TEST(AveragedRuns, GiveNearlyTheSameKWhereTheSpeedsScatter) {
  // The mean of T ω² is not that of T times that of ω²: the speeds scatter by 2e-4, so k by about its square.
  const auto steps = study_steps({}, 3);
  const Identification one = identify(steps), other = identify(means_in_a_file(steps));
  for (std::size_t i = 0; i < one.table.size(); ++i) EXPECT_NEAR(other.table[i].k / one.table[i].k, 1, 1e-6);
}

TEST(AveragedRuns, WeighARowByWhatItAverages) {
  auto steps = study_steps({}, 5);
  for (StepMean& step : steps) {
    step.speed_rad_s = step.commanded_speed_rad_s;
    if (step.repetition == 2 && step.step > 20)
      step.quality_flags = static_cast<std::uint32_t>(results::QualityFlag::saturated);
  }
  const Identification one = identify(steps), other = identify(means_in_a_file(steps));
  for (std::size_t i = 0; i < one.table.size(); ++i) EXPECT_NEAR(other.table[i].k / one.table[i].k, 1, 1e-12);
}

/// K_T, each k, intercept, slope, in this order.
std::vector<Budget> budgets(std::span<const StepMean> steps, const StudyTruth& truth) {
  const Analysis analysis = analyse(identify(steps), study_options(truth));
  std::vector<Budget> result = analysis.coefficients;
  result.insert(result.end(), analysis.parameters.begin(), analysis.parameters.end());
  return result;
}

TEST(AveragedRuns, HaveTheIntervalsOfTheStepsAndHoldTheTruth) {
  constexpr unsigned kCampaigns = 60;
  for (const double between : {0.0, 0.003}) {
    const StudyTruth truth{.between_runs = between};
    double ratios = 0, within = 0, steps_within = 0, all = 0;
    for (unsigned seed = 1; seed <= kCampaigns; ++seed) {
      const double air = study_campaign(truth, seed).density / kStandardDensity;
      std::vector<double> truths;
      for (const double phi : {0.0, 45.0, 90.0, 180.0, 270.0}) truths.push_back(truth.k(phi) * air);
      truths.push_back(truth.line.intercept * air);
      truths.push_back(truth.line.slope_per_deg * air);
      const auto steps = study_steps(truth, seed);
      const auto of_steps = budgets(steps, truth), of_means = budgets(means_in_a_file(steps), truth);
      for (std::size_t i = 0; i < truths.size(); ++i) {
        ratios += of_means.at(i).expanded() / of_steps.at(i).expanded();
        within += std::abs(of_means[i].value - truths[i]) <= of_means[i].expanded();
        steps_within += std::abs(of_steps[i].value - truths[i]) <= of_steps[i].expanded();
        ++all;
      }
    }
    EXPECT_NEAR(ratios / all, 1, 0.07) << between << ": a mean does not tell a zero from a mounting";
    EXPECT_GE(within / all, 0.92) << between << ", of the steps " << steps_within / all;
    EXPECT_NEAR(within, steps_within, 0.03 * all) << between;
  }
}

TEST(AveragedRuns, TellNoScatterWhereTheirNumberIsUnknown) {
  auto means = results::means_of(study_steps({}, 1));
  EXPECT_FALSE(averages_unknown(means));
  EXPECT_EQ(repetitions_averaged(means), 3);
  EXPECT_TRUE(identify(means).repeatability.repeated);
  for (StepMean& mean : means) mean.repetitions_averaged = mean.k_scatter_share = mean.thrust_scatter_n = std::nan("");
  EXPECT_TRUE(averages_unknown(means));
  EXPECT_FALSE(repetitions_averaged(means));
  const Identification found = identify(means);
  EXPECT_FALSE(found.repeatability.repeated);
  EXPECT_TRUE(found.repeatability.mounting_assumed);
  EXPECT_EQ(found.table.front().repetitions, 1u);
}

TEST(AveragedRuns, OfOneRepetitionAreThatRepetition) {
  std::vector<StepMean> steps;
  for (const StepMean& step : study_steps({}, 2))
    if (step.repetition == 1) steps.push_back(step);
  const auto means = means_in_a_file(steps);
  EXPECT_EQ(repetitions_averaged(means), 1);
  const Identification one = identify(steps), other = identify(means);
  EXPECT_FALSE(other.repeatability.repeated);
  for (std::size_t i = 0; i < one.table.size(); ++i)
    EXPECT_NEAR(other.table[i].standard_error / one.table[i].standard_error, 1, 1e-9);
}

}  // namespace averaged_runs_test
}  // namespace kphi::fit
