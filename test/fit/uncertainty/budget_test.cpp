#include "fit/uncertainty/budget.hpp"

#include <gtest/gtest.h>

#include <cmath>

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
