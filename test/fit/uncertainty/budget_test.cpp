#include "fit/uncertainty/budget.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "base/error.hpp"

namespace kphi::fit {
namespace budget_test {

BudgetRow row(const char* source, double contribution, double freedom) {
  BudgetRow one;
  one.source = source;
  one.u = contribution;
  one.sensitivity = 1;
  one.freedom = freedom;
  return one;
}

// JCGM 100:2008, H.1.6: standard 25 nm (18), comparator 9.7 nm (25.6), expansion 2.9 nm (50), temperature 16.6 nm (2).
TEST(Budget, ReproducesTheGaugeBlockOfTheGum) {
  const Budget budget{
      "length",
      "nm",
      50000838,
      {row("standard", 25, 18), row("comparator", 9.7, 25.6), row("expansion", 2.9, 50), row("temperature", 16.6, 2)}};
  EXPECT_NEAR(budget.combined(), 32, 0.5);
  EXPECT_EQ(std::floor(budget.freedom()), 16);
  EXPECT_NEAR(budget.coverage(0.99), 2.92, 0.02);
  EXPECT_NEAR(budget.expanded(0.99), 93, 1.5) << "with u rounded up to 32 and the freedom down to 16";
}

BudgetRow rectangle(const char* source, double half_width) {
  return row(source, half_width / std::sqrt(3), std::numeric_limits<double>::infinity());
}

/// Half of the shortest interval that holds 95 % of the sum of draws.
double monte_carlo(const std::function<double(std::mt19937&)>& draw) {
  constexpr std::size_t kDraws = 200000;
  std::mt19937 random(101);
  std::vector<double> sums(kDraws);
  for (double& sum : sums) sum = draw(random);
  std::ranges::sort(sums);
  const auto held = static_cast<std::size_t>(0.95 * kDraws);
  double shortest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + held < kDraws; ++i) shortest = std::min(shortest, sums[i + held] - sums[i]);
  return 0.5 * shortest;
}

struct Additive {
  const char* name;
  double width;             ///< of the last of four inputs; the others have u = 1
  bool normal;              ///< else rectangles
  double u, gum, by_draws;  ///< as published: standard uncertainty, 95 % of the framework and of the Monte Carlo method
};

// JCGM 101:2008, 9.2, tables 2 to 4: Y = X1 + X2 + X3 + X4. A budget is never too narrow there, and too wide where one
// rectangle rules.
TEST(Budget, ReproducesTheAdditiveModelsOfTheSupplement) {
  for (const Additive& published :
       {Additive{"normal", 1, true, 2.0, 3.92, 3.92}, Additive{"rectangles", 1, false, 2.0, 3.92, 3.88},
        Additive{"one rectangle rules", 10, false, 10.1, 19.9, 17.0}}) {
    Budget budget{"Y", "1", 0, {}};
    for (const double u : {1.0, 1.0, 1.0, published.width})
      budget.rows.push_back(published.normal ? row("X", u, std::numeric_limits<double>::infinity())
                                             : rectangle("X", u * std::sqrt(3)));
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-std::sqrt(3), std::sqrt(3));
    const double drawn = monte_carlo([&](std::mt19937& random) {
      double sum = 0;
      for (const double u : {1.0, 1.0, 1.0, published.width})
        sum += u * (published.normal ? normal(random) : uniform(random));
      return sum;
    });
    EXPECT_NEAR(budget.combined(), published.u, 0.06) << published.name;
    EXPECT_NEAR(budget.expanded(), published.gum, 0.05) << published.name;
    EXPECT_NEAR(drawn, published.by_draws, 0.05) << published.name;
    EXPECT_GE(budget.expanded(), drawn - 0.05) << published.name;
  }
}

TEST(Budget, SharesAddUpToOneAndLackWhatNobodyKnows) {
  Budget budget{"k", "N", 1, {row("a", 3, 2), row("b", 4, 1e9)}};
  BudgetRow unknown = row("c", std::nan(""), 1);
  budget.rows.push_back(unknown);
  EXPECT_DOUBLE_EQ(budget.combined(), 5);
  EXPECT_DOUBLE_EQ(budget.share(budget.rows[0]) + budget.share(budget.rows[1]), 1);
  EXPECT_EQ(budget.share(unknown), 0);
  EXPECT_FALSE(budget.rows[2].known());
}

TEST(BenchUncertainty, IsReadFromWords) {
  BenchUncertainty bench;
  set_uncertainty(bench, "calibration=0.002");
  set_uncertainty(bench, "alignment-deg=1");
  EXPECT_EQ(bench.cell_calibration, 0.002);
  EXPECT_NEAR(*bench.alignment_rad, 0.017453, 1e-6);
  EXPECT_FALSE(bench.motor_clock);
  for (const char* wrong : {"calibration", "calibration=", "calibration=-1", "=1", "weather=1", "clock=x", ""})
    EXPECT_THROW(set_uncertainty(bench, wrong), ConfigurationError) << wrong;
}

}  // namespace budget_test
}  // namespace kphi::fit
