// The line k(φ) = intercept + slope φ.
//
// By default it goes freely through the occluded points, φ > 0, and K_T = k(0) is separate. φ = 0 is not collinear with
// them: the paper's own numbers (1, 0.90 at 45°, 0.25 at 270°) have slope −0.22 %/° up to 45° and −0.29 %/° beyond, so
// a line pulled to K_T would miss every occluded point. Anchored, the line starts at K_T: k does not jump at first
// contact, but the residual is larger.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "fit/model/curve_fit.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

/// Σ w, Σ w φ, Σ w φ² with the weights of a fit.
struct WeightSums {
  WeightSums(const std::vector<CurvePoint>& points, const std::vector<double>& sigmas) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double weight = 1 / (sigmas[i] * sigmas[i]);
      sum += weight;
      first += weight * points[i].phi_deg;
      second += weight * points[i].phi_deg * points[i].phi_deg;
    }
  }
  double sum = 0, first = 0, second = 0;
};

/// Of intercept and slope over `all`, with the weights of the fit.
std::array<std::vector<double>, 2> line_weights(const CurveFit& fit, std::span<const CurvePoint> all) {
  const auto [sum, first, second] = WeightSums(fit.points, fit.sigmas);
  const double determinant = sum * second - first * first;
  std::array<std::vector<double>, 2> result{std::vector<double>(all.size()), std::vector<double>(all.size())};
  auto& [intercept, slope] = result;
  for (std::size_t j = 0; j < all.size(); ++j) {
    const double phi = all[j].phi_deg;
    for (std::size_t i = 0; i < fit.points.size(); ++i) {
      if (std::abs(fit.points[i].phi_deg - phi) >= kSameAngleDeg) continue;
      const double weight = 1 / (fit.sigmas[i] * fit.sigmas[i]);
      if (!fit.anchored) intercept[j] += weight * (second - first * phi) / determinant;
      slope[j] += fit.anchored ? weight * phi / second : weight * (sum * phi - first) / determinant;
    }
    if (fit.anchored && std::abs(phi) < kSameAngleDeg) {
      intercept[j] = 1;
      slope[j] -= first / second;
    }
  }
  return result;
}

class LineModel final : public CurveModel {
 public:
  const char* name() const override { return "line"; }
  const char* denial() const override { return "k(φ) is not a line"; }
  const char* remedy() const override { return "; if they are right, fit a table (--form table)"; }
  std::size_t least_points(bool anchored) const override { return anchored ? 1 : 2; }
  std::size_t terms(const CurveFit& line) const override { return line.anchored ? 1 : 2; }
  bool may_miss(const CurveFit& line, double phi_deg) const override { return phi_deg > 0 || !line.anchored; }
  std::vector<double> basis(const CurveFit&, double phi_deg) const override { return {1, phi_deg}; }
  std::string words(const CurveFit& line) const override {
    return line.anchored ? "line, anchored at K_T" : "line, free";
  }

  std::vector<CurveParameter> parameters(const CurveFit& fit, std::span<const CurvePoint> all) const override {
    std::vector<std::vector<double>> rows;
    std::vector<double> k, weights;
    for (std::size_t i = 0; i < fit.points.size(); ++i) {
      const double phi = fit.points[i].phi_deg;
      rows.push_back(fit.anchored ? std::vector{phi} : std::vector{1.0, phi});
      k.push_back(fit.points[i].k - (fit.anchored ? fit.K_T : 0));
      weights.push_back(1 / (fit.sigmas[i] * fit.sigmas[i]));
    }
    const std::vector<double> found = regress(rows, k, weights).estimates;
    auto [intercept, slope] = line_weights(fit, all);
    return {{"intercept", "intercept", "", fit.anchored ? fit.K_T : found.front(), std::move(intercept)},
            {"slope_per_deg", "slope", "/deg", found.back(), std::move(slope)}};
  }

  double first_fitted_deg(const CurveFit& line) const override {
    return line.anchored ? 0 : line.points.front().phi_deg;
  }

  std::optional<double> falls_to(const CurveFit& line, double k) const override {
    const double slope = line.value("slope_per_deg");
    return slope < 0 ? std::optional((k - line.k_at(0)) / slope) : std::nullopt;
  }

  Curvature tested(const CurveFit& line, double freedom) const override {
    std::vector<CurvePoint> points = line.points;
    if (line.anchored && points.front().phi_deg != 0)
      points.insert(points.begin(), {0, line.K_T, line.K_T_standard_error});
    return curvature(points, freedom);
  }

  std::vector<std::string> remarks(const CurveFit& line, const Estimate& mismatch, double largest_deg) const override {
    std::vector<std::string> remarks;
    const double share = 100 * line.mismatch() / line.K_T;
    if (!line.anchored) {
      const HypothesisTest none = student_test(mismatch, 0);
      remarks.push_back(fmt::format("the line's intercept is {:+.2f} % from K_T{}", share,
                                    !none.tested()    ? ""
                                    : none.rejected() ? ", beyond its error"
                                                      : ", within its error"));
    }
    if (!line.zero_crossing_deg()) {
      remarks.push_back(
          "the line does not fall with phi: either the occlusion costs no thrust or the runs were mixed up");
      return remarks;
    }
    const double clipping = *line.clipping_deg(), zero = *line.zero_crossing_deg();
    if (clipping > 0)
      remarks.push_back(fmt::format(
          "up to {:.1f}° the line is above K_T, so k_i is held at 1: no occlusion gives more thrust", clipping));
    if (clipping < 0)
      remarks.push_back(
          fmt::format("at first contact the line is already {:.2f} % below K_T, so k_i steps there", -share));
    if (zero < 360)
      remarks.push_back(fmt::format("the line reaches 0 at {:.1f}°; it was measured up to {}°", zero, largest_deg));
    return remarks;
  }

  std::optional<compensation::ThrustCurve> flown(const CurveFit& line, Radians largest,
                                                 compensation::OverlapMeasure overlap) const override {
    constexpr double kPerRad = 180 / kPi;
    return compensation::ThrustCurve::from_line(ThrustCoefficient(line.K_T), ThrustCoefficient(line.value("intercept")),
                                                line.value("slope_per_deg") * kPerRad, largest, overlap);
  }
};

}  // namespace

const CurveModel& line_model() {
  static const LineModel model;
  return model;
}

Curvature curvature(std::span<const CurvePoint> points, double freedom) {
  Curvature result;
  const double m = static_cast<double>(points.size());
  if (m >= 3 && std::ranges::all_of(points, [](const auto& point) { return point.standard_error > 0; })) {
    std::vector<double> phi, k, weights;
    double scale = 0;
    for (const CurvePoint& point : points) scale = std::max(scale, point.phi_deg);
    for (const CurvePoint& point : points) {
      phi.push_back(point.phi_deg / scale);
      k.push_back(point.k);
      weights.push_back(1 / (point.standard_error * point.standard_error));
    }
    const double straight = regress_polynomial(phi, k, 0, 1, weights).weighted_squares;
    const Regression parabola = regress_polynomial(phi, k, 0, 2, weights);
    result.lack_of_fit = f_test(straight / (m - 2), m - 2, freedom);
    result.quadratic = f_test(straight - parabola.weighted_squares, 1, freedom);
    result.second_order = parabola.estimates[2] / (scale * scale);
    result.second_order_u = std::sqrt(parabola.covariance[2][2]) / (scale * scale);
  }
  result.lack_of_fit.name = "lack of fit of the line k(phi)";
  result.quadratic.name = "third term of a parabola k(phi)";
  result.lack_of_fit.hypothesis = result.quadratic.hypothesis = "k(phi) is a line";
  result.lack_of_fit.statistic = result.quadratic.statistic = "F";
  return result;
}

}  // namespace kphi::fit
