#include "fit/uncertainty/bootstrap.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fit/model/identification.hpp"
#include "test/fit/bench_study.hpp"

namespace kphi::fit {
namespace bootstrap_test {

AngleScatter runs_of(double phi, std::initializer_list<double> k) {
  AngleScatter angle;
  for (const double one : k)
    angle.runs.push_back(
        {.phi_deg = phi, .repetition = static_cast<int>(angle.runs.size()) + 1, .xt = 2 * one, .xx = 2});
  return angle;
}

// Three runs drawn with replacement: the mean has the variance Σ(k − mean)²/n², and 1/27 for each end.
TEST(Bootstrap, OfThreeRunsHasTheVarianceThatCombinatoricsGives) {
  const auto result = bootstrap(std::vector{runs_of(0, {1, 2, 3})}, {{1}, {0}}, {20000, 7});
  ASSERT_EQ(result.size(), 3u);
  EXPECT_EQ(result[0].quantity, "K_T");
  EXPECT_DOUBLE_EQ(result[0].value, 2);
  EXPECT_NEAR(result[0].standard_error, std::sqrt(2.0) / 3, 0.01);
  EXPECT_DOUBLE_EQ(result[0].lower, 1) << "1/27 = 3.7 % of the draws take the lowest run thrice";
  EXPECT_DOUBLE_EQ(result[0].upper, 3);
}

TEST(Bootstrap, CarriesTheLineAlong) {
  const std::vector angles{runs_of(0, {10, 10}), runs_of(100, {5, 7})};
  const auto result = bootstrap(angles, {{1, 0}, {-0.01, 0.01}}, {5000, 1});
  ASSERT_EQ(result.size(), 4u);
  EXPECT_EQ(result[3].quantity, "slope");
  EXPECT_NEAR(result[3].value, -0.04, 1e-15);
  EXPECT_NEAR(result[3].standard_error, 0.01 / std::sqrt(2.0), 3e-4);
  EXPECT_NEAR(result[2].standard_error, 0, 1e-12) << "the intercept hangs on φ = 0 alone, whose runs agree";
}

TEST(Bootstrap, IsTheSameForTheSameSeedAndNothingForNothing) {
  const std::vector angles{runs_of(0, {1, 2, 4})};
  const BootstrapOptions options{1000, 3};
  EXPECT_EQ(bootstrap(angles, {{1}, {0}}, options)[0].standard_error,
            bootstrap(angles, {{1}, {0}}, options)[0].standard_error);
  EXPECT_TRUE(bootstrap({}, {}, options).empty());
  EXPECT_TRUE(bootstrap(angles, {{1}, {0}}, {0, 1}).empty());
}

TEST(Bootstrap, AgreesWithTheBudgetUpToItsNarrowness) {
  double ratio = 0;
  const int draws = 30;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Identification found = identify(study_campaign({}, seed).steps);
    AnalysisOptions options;
    options.bootstrap.resamples = 2000;
    const Analysis analysis = analyse(found, options);
    ratio += analysis.bootstrap.front().standard_error / analysis.coefficients.front().combined() / draws;
  }
  EXPECT_NEAR(ratio, std::sqrt(2.0 / 3), 0.12) << "three runs: the bootstrap divides by n, not n - 1";
}

}  // namespace bootstrap_test
}  // namespace kphi::fit
