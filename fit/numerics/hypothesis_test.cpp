#include "fit/numerics/hypothesis_test.hpp"

#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

namespace kphi::fit {
namespace {

using boost::math::cdf;
using boost::math::complement;

/// From here on Student's distribution is the normal one to all digits that matter.
constexpr double kManyDegrees = 1e6;

double two_sided(double t, double freedom) {
  if (freedom > kManyDegrees) return 2 * cdf(complement(boost::math::normal(), std::abs(t)));
  return 2 * cdf(complement(boost::math::students_t(freedom), std::abs(t)));
}

}  // namespace

double coverage_factor(double freedom, double level) {
  const double tail = (1 - level) / 2;
  if (freedom > kManyDegrees) return boost::math::quantile(complement(boost::math::normal(), tail));
  if (!(freedom > 0)) return std::numeric_limits<double>::infinity();
  return boost::math::quantile(complement(boost::math::students_t(freedom), tail));
}

HypothesisTest student_test(const Estimate& estimate, double expected) {
  HypothesisTest test;
  test.statistic = "t";
  test.freedom = estimate.freedom;
  if (!(estimate.u > 0) || !(estimate.freedom > 0)) return test;
  test.value = (estimate.value - expected) / estimate.u;
  test.p = two_sided(test.value, estimate.freedom);
  return test;
}

Estimate difference(const Estimate& a, const Estimate& b) {
  Estimate result{a.value - b.value, std::hypot(a.u, b.u), std::numeric_limits<double>::infinity()};
  const double spread = std::pow(a.u, 4) / a.freedom + std::pow(b.u, 4) / b.freedom;
  if (spread > 0) result.freedom = std::pow(result.u, 4) / spread;
  return result;
}

HypothesisTest welch_test(const Estimate& a, const Estimate& b) { return student_test(difference(a, b), 0); }

HypothesisTest f_test(double value, double freedom, double error_freedom) {
  HypothesisTest test;
  test.statistic = "F";
  test.freedom = freedom;
  test.error_freedom = error_freedom;
  if (!(freedom > 0) || !(error_freedom > 0) || !std::isfinite(value) || value < 0) return test;
  test.value = value;
  test.p = cdf(complement(boost::math::fisher_f(freedom, std::min(error_freedom, kManyDegrees)), value));
  return test;
}

}  // namespace kphi::fit
