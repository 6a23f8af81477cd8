// Tests of hypotheses, each with its statistic, degrees of freedom and p, so that a verdict can be checked.
#pragma once

#include <limits>
#include <string>
#include <vector>

namespace kphi::fit {

/// Level of all tests.
inline constexpr double kTestLevel = 0.05;

struct HypothesisTest {
  std::string name;        ///< "lack of fit of T = k w^2 at phi = 45 deg"
  std::string hypothesis;  ///< true unless the test rejects it
  std::string statistic;   ///< "F" or "t"
  double value = std::numeric_limits<double>::quiet_NaN();
  double freedom = 0;        ///< of t; of F's numerator
  double error_freedom = 0;  ///< of F's denominator; 0 for t
  /// Probability of a statistic at least as extreme under the hypothesis; NaN: could not be tested (too little data).
  double p = std::numeric_limits<double>::quiet_NaN();

  [[nodiscard]] bool tested() const { return p == p; }
  [[nodiscard]] bool rejected() const { return p < kTestLevel; }
};

/// A number with its uncertainty.
struct Estimate {
  double value = 0;
  double u = 0;  ///< standard uncertainty
  double freedom = std::numeric_limits<double>::infinity();
};

/// Two-sided Student test of value = expected.
[[nodiscard]] HypothesisTest student_test(const Estimate& estimate, double expected);

/// Welch's test of equal means: two independent estimates, unequal variances.
[[nodiscard]] HypothesisTest welch_test(const Estimate& a, const Estimate& b);

/// F test; `value` is a ratio of mean squares.
[[nodiscard]] HypothesisTest f_test(double value, double freedom, double error_freedom);

/// a − b of independent estimates, degrees of freedom by Welch-Satterthwaite (science.md, eq. 18).
[[nodiscard]] Estimate difference(const Estimate& a, const Estimate& b);

/// Holm's procedure: of several tests those with p below this fall, so that one of true hypotheses falls by chance in
/// `level` of all cases. NaN (not tested) does not count.
[[nodiscard]] double holm_level(std::vector<double> p, double level = kTestLevel);

/// Student's two-sided factor: value ± factor · u covers with `level`. Infinite freedom: 1.96.
[[nodiscard]] double coverage_factor(double freedom, double level = 0.95);
/// Half of the 95 % interval; NaN: unknown.
[[nodiscard]] double expanded(const Estimate& estimate);

}  // namespace kphi::fit
