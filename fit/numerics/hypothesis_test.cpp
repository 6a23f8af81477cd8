#include "fit/numerics/hypothesis_test.hpp"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "results/reduction/bin_statistics.hpp"

namespace kphi::fit {
namespace {

using boost::math::cdf;
using boost::math::complement;

constexpr double kManyDegrees = 1e6;  // as good as endless, and computable

}  // namespace

double coverage_factor(double freedom, double level) {
  return freedom > 0 ? results::student(freedom, level) : std::numeric_limits<double>::infinity();
}

double holm_level(std::vector<double> p, double level) {
  std::erase_if(p, [](double one) { return std::isnan(one); });
  std::ranges::sort(p);
  const auto m = static_cast<double>(p.size());
  double threshold = level / std::max(m, 1.0);
  for (std::size_t i = 0; i < p.size() && p[i] < threshold; ++i)
    threshold = level / std::max(m - static_cast<double>(i) - 1, 1.0);
  return threshold;
}

HypothesisTest student_test(const Estimate& estimate, double expected) {
  HypothesisTest test;
  test.statistic = "t";
  test.freedom = estimate.freedom;
  if (!(estimate.u > 0) || !(estimate.freedom > 0)) return test;
  test.value = (estimate.value - expected) / estimate.u;
  test.p = 2 * cdf(complement(boost::math::students_t(estimate.freedom), std::abs(test.value)));
  return test;
}

Estimate difference(const Estimate& a, const Estimate& b) {
  return {a.value - b.value, std::hypot(a.u, b.u), results::joint_freedom(a.u, a.freedom, b.u, b.freedom)};
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

double expanded(const Estimate& estimate) {
  return std::isnan(estimate.u) ? estimate.u : coverage_factor(estimate.freedom) * estimate.u;
}

}  // namespace kphi::fit
