#include "fit/uncertainty/curvature.hpp"

#include <cmath>
#include <limits>

#include "base/error.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

/// Akaike's criterion for known variances, corrected for n observations (Hurvich, Tsai 1989).
double corrected_aic(double chi_squared, double terms, double n) {
  const double room = n - terms - 1;
  if (room <= 0) return std::numeric_limits<double>::infinity();
  return chi_squared + 2 * terms + 2 * terms * (terms + 1) / room;
}

}  // namespace

Curvature curvature(std::span<const LinePoint> points, double freedom) {
  Curvature result;
  result.lack_of_fit.name = "lack of fit of the line k(phi)";
  result.lack_of_fit.statistic = "F";
  result.lack_of_fit.hypothesis = "k(phi) is a line";
  result.quadratic.name = "third term of a parabola k(phi)";
  result.quadratic.statistic = "F";
  result.quadratic.hypothesis = result.lack_of_fit.hypothesis;
  std::vector<double> phi, k, weights;
  double scale = 0;
  for (const LinePoint& point : points) scale = std::max(scale, point.phi_deg);
  for (const LinePoint& point : points) {
    if (!(point.standard_error > 0)) return result;
    phi.push_back(point.phi_deg / scale);
    k.push_back(point.k);
    weights.push_back(1 / (point.standard_error * point.standard_error));
  }
  const double m = static_cast<double>(points.size());
  if (m < 3) return result;
  const double straight = regress_polynomial(phi, k, 0, 1, weights).weighted_squares;
  const Regression parabola = regress_polynomial(phi, k, 0, 2, weights);
  const auto finish = [](HypothesisTest& test, const HypothesisTest& found) {
    test.value = found.value;
    test.freedom = found.freedom;
    test.error_freedom = found.error_freedom;
    test.p = found.p;
  };
  finish(result.lack_of_fit, f_test(straight / (m - 2), m - 2, freedom));
  finish(result.quadratic, f_test(straight - parabola.weighted_squares, 1, freedom));
  result.second_order = parabola.estimates[2] / (scale * scale);
  result.second_order_u = std::sqrt(parabola.covariance[2][2]) / (scale * scale);
  const double observations = m + (std::isfinite(freedom) ? freedom : 0);
  result.linear_aic = corrected_aic(straight, 2, observations);
  result.quadratic_aic = corrected_aic(parabola.weighted_squares, 3, observations);
  return result;
}

}  // namespace kphi::fit
