#include "fit/numerics/hypothesis_test.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace kphi::fit {
namespace hypothesis_test_test {

TEST(HypothesisTest, KnowsStudentsFactors) {
  EXPECT_NEAR(coverage_factor(2), 4.302652729911275, 1e-9);
  EXPECT_NEAR(coverage_factor(10), 2.228138851964939, 1e-9);
  EXPECT_NEAR(coverage_factor(std::numeric_limits<double>::infinity()), 1.959963984540054, 1e-9);
  EXPECT_NEAR(coverage_factor(2, 0.99), 9.924843200918293, 1e-8);
}

TEST(HypothesisTest, TOnOneDegreeAndFAreTheSameTest) {
  for (const double t : {0.3, 1.0, 2.5, 6.0}) {
    const HypothesisTest student = student_test({t, 1, 7}, 0);
    EXPECT_NEAR(f_test(t * t, 1, 7).p, student.p, 1e-12);
  }
}

TEST(HypothesisTest, RejectsAtTheLevel) {
  EXPECT_TRUE(student_test({4.31, 1, 2}, 0).rejected());
  EXPECT_FALSE(student_test({4.29, 1, 2}, 0).rejected());
  EXPECT_FALSE(student_test({100, 0, 2}, 0).tested()) << "without an error nothing is tested";
  EXPECT_FALSE(student_test({100, 1, 0}, 0).tested());
  EXPECT_FALSE(f_test(5, 2, 0).tested());
  EXPECT_FALSE(f_test(5, 2, 0).rejected());
}

TEST(HypothesisTest, WelchTakesTheFreedomOfTheWorse) {
  const Estimate sharp{1, 0.001, 100}, blunt{2, 0.5, 2};
  EXPECT_NEAR(difference(sharp, blunt).freedom, 2, 1e-4);
  EXPECT_NEAR(difference({0, 1, 4}, {0, 1, 4}).freedom, 8, 1e-12);
  EXPECT_TRUE(std::isinf(difference({0, 1}, {0, 1}).freedom));
  EXPECT_FALSE(welch_test(sharp, blunt).rejected());
}

}  // namespace hypothesis_test_test
}  // namespace kphi::fit
