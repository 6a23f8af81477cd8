#include "fit/propellers/compare.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "base/error.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "results/steps_csv.hpp"
#include "test/fit/campaign_steps.hpp"
#include "test/temporary_folder.hpp"

namespace kphi::fit {
namespace compare_test {

using test::TemporaryFolder;
using ::testing::HasSubstr;

ComparedResult result(std::vector<ComparedValue> values) {
  ComparedResult made;
  made.name = "made";
  made.propeller = "5x3";
  made.speed_min_rad_s = 300;
  made.speed_max_rad_s = 2000;
  made.air = Estimate{kStandardDensity, 0};
  made.estimates = values;
  return made;
}

std::string campaign(const TemporaryFolder& folder, const char* name, const CampaignTruth& truth, unsigned seed) {
  const auto path = folder.path() / name;
  std::filesystem::create_directories(path);
  std::ofstream(path / "coefficients.yaml") << format_coefficients(analysed(identify(campaign_steps(truth, seed))), {});
  return path.string();
}

TEST(Compare, FindsADifferenceLargerThanItsUncertainty) {
  const Comparison apart = compare(result({{"K_T", "", 1.50e-6, 1e-9}}), result({{"K_T", "", 1.51e-6, 1e-9}}));
  EXPECT_EQ(apart.verdict, Agreement::differ);
  EXPECT_NEAR(apart.differences[0].difference, 1e-8, 1e-15);
  EXPECT_NEAR(*apart.differences[0].standard_error, std::sqrt(2) * 1e-9, 1e-15);
  const Comparison close = compare(result({{"K_T", "", 1.50e-6, 1e-8}}), result({{"K_T", "", 1.51e-6, 1e-8}}));
  EXPECT_EQ(close.verdict, Agreement::agree);
  EXPECT_NEAR(*close.differences[0].p, 0.4795, 1e-4) << "two-sided, z = 1/sqrt(2)";
  EXPECT_NEAR(close.largest_open_share, (1e-8 + 1.95996 * std::sqrt(2) * 1e-8) / 1.5e-6, 1e-6)
      << "agreement is only as good as the data";
}

TEST(Compare, MeasuresTheDistanceFromTheSimulatedTruth) {
  const TemporaryFolder folder;
  const std::string truth = (folder.path() / "truth.yaml").string();
  std::ofstream(truth) << "format: kphi-truth/1\npropellers:\n  5x3:\n    K_T: 1.5e-06\n    line: {intercept: 1.6e-06, "
                          "slope_per_deg: -4.0e-09}\n";
  const auto check = [&](double K_T, double slope) {
    return check_against_truth(result({{"K_T", "", K_T, 0}, {"slope", "", slope, 0}}), truth);
  };
  EXPECT_TRUE(check(1.507e-6, -4.07e-9).close);
  EXPECT_THAT(check(1.507e-6, -4.07e-9).text, HasSubstr("+0.467 %"));
  EXPECT_FALSE(check(1.508e-6, -4.0e-9).close) << "0.53 %";
  EXPECT_FALSE(check(1.5e-6, -4.09e-9).close) << "2.25 %";
  const auto told = [&](double u) {
    return check_against_truth(result({{"K_T", "", 1.515e-6, u}, {"slope", "", -4e-9, 0}}), truth).close;
  };
  EXPECT_TRUE(told(0.8e-8)) << "1 % off, 1.05 % told";
  EXPECT_FALSE(told(0.7e-8)) << "0.91 % told";
  ComparedResult other = result({{"K_T", "", 1, 0}});
  other.propeller = "6x3";
  EXPECT_THROW((void)check_against_truth(other, truth), ConfigurationError);
  EXPECT_THROW((void)check_against_truth(result({{"K_T", "", 1, 0}}), truth), ConfigurationError);
}

TEST(Compare, DoesNotDecideWithoutUncertainties) {
  EXPECT_EQ(compare(result({{"K_T", "", 1, 0}}), result({{"K_T", "", 2, 0.1}})).verdict, Agreement::undecided);
  EXPECT_EQ(compare(result({{"K_T", "", 1, 1}}), result({{"k(45°)", "", 2, 0.1}})).verdict, Agreement::undecided);
}

TEST(Compare, CorrectsForTheNumberOfComparisons) {
  // One of five at p = 0.03 is what chance does; of one comparison it is a finding.
  const double z = 2.17;
  std::vector<ComparedValue> a, b;
  for (int i = 0; i < 5; ++i) {
    a.push_back({"k" + std::to_string(i), "", 1, 0.01 / std::sqrt(2)});
    b.push_back({"k" + std::to_string(i), "", 1 + (i == 2 ? 0.01 * z : 0), 0.01 / std::sqrt(2)});
  }
  EXPECT_EQ(compare(result(a), result(b)).verdict, Agreement::agree);
  EXPECT_EQ(compare(result({a[2]}), result({b[2]})).verdict, Agreement::differ);
}

// Holm: the second smallest p is judged against level/(m − 1), Bonferroni would judge it against level/m.
TEST(Compare, JudgesEachFurtherDifferenceAgainstAHigherLevel) {
  const auto found = [](double first_z, double second_z) {
    const double u = 0.01 / std::sqrt(2);
    const Comparison both =
        compare(result({{"K_T", "", 1, u}, {"slope", "", 1, u}}),
                result({{"K_T", "", 1 + 0.01 * first_z, u}, {"slope", "", 1 + 0.01 * second_z, u}}));
    return std::pair(both.differences[0].significant, both.differences[1].significant);
  };
  constexpr double kOf0p01 = 2.576, kOf0p03 = 2.170, kOf0p04 = 2.054;
  EXPECT_EQ(found(kOf0p01, kOf0p04), std::pair(true, true));
  EXPECT_EQ(found(kOf0p03, kOf0p04), std::pair(false, false)) << "the smallest p stands above level/2";
}

TEST(Compare, IsWrongOnceInTwentyOfEqualPairs) {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 1);
  int differ = 0;
  constexpr int kTrials = 4000;
  for (int trial = 0; trial < kTrials; ++trial) {
    ComparedResult a = result({}), b = result({});
    for (int i = 0; i < 5; ++i) {
      a.estimates.push_back({"k" + std::to_string(i), "", 10 + noise(random), 1});
      b.estimates.push_back({"k" + std::to_string(i), "", 10 + noise(random), 1});
    }
    differ += compare(a, b).verdict == Agreement::differ ? 1 : 0;
  }
  EXPECT_NEAR(differ / static_cast<double>(kTrials), 0.05, 0.012);
}

TEST(Compare, ReadsCampaignFolders) {
  const TemporaryFolder folder;
  const CampaignTruth truth, other{1.02 * truth.K_T, 1.02 * truth.intercept};
  const std::string monday = campaign(folder, "monday", {}, 1), tuesday = campaign(folder, "tuesday", {}, 2),
                    changed = campaign(folder, "changed", other, 3);
  const Comparison same = compare(load_result(monday), load_result(tuesday));
  EXPECT_EQ(same.verdict, Agreement::agree) << comparison_table(same);
  EXPECT_EQ(same.differences.size(), 7u) << "K_T, four occlusions, intercept, slope";
  const Comparison apart = compare(load_result(monday), load_result(changed));
  EXPECT_EQ(apart.verdict, Agreement::differ);
  EXPECT_THAT(comparison_table(apart), HasSubstr("verdict  differ"));
  EXPECT_THAT(comparison_table(same), HasSubstr("k(45°)"));
}

TEST(Compare, TakesALogWithTheBudgetOfItsFit) {
  auto steps = campaign_steps();
  std::erase_if(steps, [](const results::StepMean& step) { return step.occlusion_deg > 0; });
  const Fitted fitted = analysed(identify(steps));
  const ComparedResult log = result_of_log(fitted, Origin::measured, "log");
  ASSERT_EQ(log.estimates.size(), 1u);
  EXPECT_EQ(log.estimates[0].value, fitted.identification.table.front().k);
  EXPECT_EQ(log.estimates[0].standard_error, fitted.analysis.coefficients.front().combined());
  EXPECT_GT(log.estimates[0].standard_error, 0);
  EXPECT_NEAR(to_rpm(RadPerSec(log.speed_max_rad_s)), 19100, 1);
}

TEST(Compare, RefusesStepsThatWereNotFitted) {
  const TemporaryFolder folder;
  results::write_steps(folder.path() / "steps.csv", campaign_steps());
  EXPECT_THROW((void)load_result(folder.path().string()), ConfigurationError);
}

TEST(Compare, RemarksWhatMakesResultsUnlike) {
  ComparedResult a = result({{"K_T", "", 1, 0.1}, {"k(90°)", "", 1, 0.1}}), b = result({{"K_T", "", 2.07, 0.1}});
  b.propeller = "6x3";
  a.diameter_in = 5;
  b.diameter_in = 6;
  b.speed_max_rad_s = 1800;
  b.air = Estimate{1.1, 0.01};
  const Comparison comparison = compare(a, b);
  EXPECT_NEAR(*comparison.diameter_ratio4, 2.0736, 1e-12);
  for (const char* remark : {"5x3 and 6x3", "different speeds", "compared in standard air", "only in made: k(90°)"})
    EXPECT_THAT(comparison.remarks, ::testing::Contains(HasSubstr(remark)));
}

TEST(Compare, SeesTheSamePropellerInAnyAir) {
  int differ = 0;
  for (unsigned seed = 1; seed <= 1000; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    ComparedResult results[2];
    for (ComparedResult& one : results) {
      const double density = 1.10 + 0.15 * static_cast<double>(random() % 1000) / 1000, u = 0.003 * density;
      const double known = density + u * normal(random);
      for (const double k : {1.5e-6, 1.3e-6, 1.1e-6, 0.7e-6, 0.4e-6})
        one.estimates.push_back(
            {fmt::format("k{}", k), "", k * density / kStandardDensity + 2e-9 * normal(random), 2e-9});
      one.air = Estimate{known, u};
    }
    differ += compare(results[0], results[1]).verdict == Agreement::differ ? 1 : 0;
  }
  EXPECT_LE(differ, 70) << "of 1000";
}

TEST(Compare, NamesAFactorThatAllHaveInCommon) {
  const auto all = [](double factor, double of_third) {
    return result({{"K_T", "", 1.5e-6 * factor, 2e-9},
                   {"k(45°)", "", 1.3e-6 * factor, 2e-9},
                   {"k(90°)", "", 1.1e-6 * factor * of_third, 2e-9}});
  };
  EXPECT_THAT(comparison_table(compare(all(1, 1), all(1.02, 1))),
              HasSubstr("every k of B is 2 % higher by one factor"));
  EXPECT_THAT(comparison_table(compare(all(1, 1), all(1.02, 1.02))), ::testing::Not(HasSubstr("by one factor")));
  EXPECT_THAT(comparison_table(compare(all(1, 1), all(1, 1))), ::testing::Not(HasSubstr("by one factor")));
}

TEST(Compare, GivesTheSameAsJson) {
  const Comparison comparison = compare(result({{"K_T", "N", 1, 0.1}, {"slope", "N", 1, 0, false}}),
                                        result({{"K_T", "N", 2, 0.1}, {"slope", "N", 2, 1, false}}));
  const auto json = nlohmann::json::parse(comparison_json(comparison));
  EXPECT_EQ(json["verdict"], "differ");
  EXPECT_EQ(json["differences"].size(), 2u);
  EXPECT_EQ(json["differences"][0]["difference"], 1.0);
  EXPECT_TRUE(json["differences"][1]["u"].is_null());
}

}  // namespace compare_test
}  // namespace kphi::fit
