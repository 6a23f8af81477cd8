#include "fit/model/line_fit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "base/error.hpp"
#include "fit/numerics/linear_regression.hpp"

namespace kphi::fit {
namespace {

/// Angles travel through files and options as decimal degrees; two of them closer than this are the same.
constexpr double kSameAngleDeg = 1e-6;

/// No k is weighted as if known better than this share of the largest |k|: mounting and air change it by at least as
/// much between two runs. Also used where a standard error is unknown.
constexpr double kErrorFloor = 1e-3;

std::vector<LinePoint> sorted(std::span<const LinePoint> points) {
  std::vector<LinePoint> result(points.begin(), points.end());
  std::ranges::sort(result, {}, &LinePoint::phi_deg);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!std::isfinite(result[i].phi_deg) || !std::isfinite(result[i].k))
      throw FitError("line fit: an angle or a coefficient is not a number");
    if (i > 0 && result[i].phi_deg - result[i - 1].phi_deg < kSameAngleDeg)
      throw FitError(fmt::format("line fit: phi = {}° is listed twice", result[i].phi_deg));
  }
  return result;
}

const LinePoint& point_at(const std::vector<LinePoint>& points, double phi_deg) {
  for (const LinePoint& point : points)
    if (std::abs(point.phi_deg - phi_deg) < kSameAngleDeg) return point;
  std::vector<double> measured;
  for (const LinePoint& point : points) measured.push_back(point.phi_deg);
  throw FitError(
      fmt::format("line fit: phi = {}° was not measured; measured are {}°", phi_deg, fmt::join(measured, ", ")));
}

std::vector<LinePoint> carriers(const std::vector<LinePoint>& points, const LineFitOptions& options) {
  std::vector<LinePoint> used;
  if (options.points_deg.empty()) {
    std::copy_if(points.begin(), points.end(), std::back_inserter(used),
                 [](const LinePoint& point) { return point.phi_deg > kSameAngleDeg; });
  }
  for (const double phi : options.points_deg) used.push_back(point_at(points, phi));
  used = sorted(used);
  const std::size_t needed = options.anchored ? 1 : 2;
  const auto occluded = std::ranges::count_if(used, [](const auto& p) { return p.phi_deg > kSameAngleDeg; });
  if (used.size() < needed || occluded < 1) {
    throw FitError(
        fmt::format("line fit: {} points for the line, but it needs {} with phi > 0; measure more occlusions{}",
                    used.size(), needed, options.anchored ? "" : " or anchor the line at K_T"));
  }
  return used;
}

double largest_k(const std::vector<LinePoint>& points) {
  double largest = 0;
  for (const LinePoint& point : points) largest = std::max(largest, std::abs(point.k));
  if (largest == 0) throw FitError("line fit: every coefficient is 0");
  return largest;
}

/// Σ w, Σ w φ, Σ w φ² with the weights of a fit.
struct WeightSums {
  WeightSums(const std::vector<LinePoint>& points, const std::vector<double>& sigmas) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double weight = 1 / (sigmas[i] * sigmas[i]);
      sum += weight;
      first += weight * points[i].phi_deg;
      second += weight * points[i].phi_deg * points[i].phi_deg;
    }
  }
  double sum = 0, first = 0, second = 0;
};

/// Akaike's criterion for known variances, corrected for n observations (Hurvich, Tsai 1989).
double corrected_aic(double chi_squared, double terms, double n) {
  const double room = n - terms - 1;
  if (room <= 0) return std::numeric_limits<double>::infinity();
  return chi_squared + 2 * terms + 2 * terms * (terms + 1) / room;
}

/// Of intercept and slope over `all`, with the weights of the fit.
std::array<std::vector<double>, 2> line_weights(const CurveFit& fit, const std::vector<LinePoint>& all) {
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

CurveFit fit_line(std::span<const LinePoint> points, const LineFitOptions& options) {
  const std::vector<LinePoint> all = sorted(points);
  if (all.empty() || std::abs(all.front().phi_deg) > kSameAngleDeg)
    throw FitError("line fit: no run at phi = 0; K_T is measured without an occlusion on the same stand");

  CurveFit fit;
  fit.anchored = options.anchored;
  fit.K_T = all.front().k;
  const double floor = kErrorFloor * largest_k(all);
  const auto known_error = [&](const LinePoint& point) {
    return point.standard_error > 0 ? point.standard_error : floor;
  };
  fit.K_T_standard_error = known_error(all.front());
  fit.points = carriers(all, options);
  std::vector<double>& sigmas = fit.sigmas;
  for (const LinePoint& point : fit.points) sigmas.push_back(std::max(known_error(point), floor));

  std::vector<std::vector<double>> rows;
  std::vector<double> k, weights;
  for (std::size_t i = 0; i < fit.points.size(); ++i) {
    const double phi = fit.points[i].phi_deg;
    rows.push_back(fit.anchored ? std::vector{phi} : std::vector{1.0, phi});
    k.push_back(fit.points[i].k - (fit.anchored ? fit.K_T : 0));
    weights.push_back(1 / (sigmas[i] * sigmas[i]));
  }
  const Regression line = regress(rows, k, weights);
  auto [intercept, slope] = line_weights(fit, all);
  fit.parameters = {
      {"intercept", "intercept", "", fit.anchored ? fit.K_T : line.estimates.front(), std::move(intercept)},
      {"slope_per_deg", "slope", "/deg", line.estimates.back(), std::move(slope)}};
  fit.residuals = line.residuals;
  return fit;
}

std::vector<std::string> line_remarks(const CurveFit& line, const Estimate& mismatch, double largest_deg) {
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
    remarks.push_back(fmt::format("up to {:.1f}° the line is above K_T, so k_i is held at 1", clipping));
  if (clipping < 0)
    remarks.push_back(
        fmt::format("at first contact the line is already {:.2f} % below K_T, so k_i steps there", -share));
  if (zero < 360)
    remarks.push_back(fmt::format("the line reaches 0 at {:.1f}°; it was measured up to {}°", zero, largest_deg));
  return remarks;
}

}  // namespace

const char* name_of(CurveForm form) {
  switch (form) {
    case CurveForm::line:
      return "line";
  }
  return "";
}

std::optional<double> CurveFit::falls_to(double k) const {
  switch (form) {
    case CurveForm::line: {
      const double slope = value("slope_per_deg");
      return slope < 0 ? std::optional((k - k_at(0)) / slope) : std::nullopt;
    }
  }
  return std::nullopt;
}

std::vector<double> CurveFit::basis_at(double phi_deg) const {
  switch (form) {
    case CurveForm::line:
      return {1, phi_deg};
  }
  return {};
}

double CurveFit::k_at(double phi_deg) const {
  double k = 0;
  const std::vector<double> basis = basis_at(phi_deg);
  for (std::size_t i = 0; i < parameters.size(); ++i) k += basis[i] * parameters[i].value;
  return k;
}

std::vector<double> CurveFit::weights_at(double phi_deg) const {
  std::vector<double> at(parameters.front().weights.size());
  const std::vector<double> basis = basis_at(phi_deg);
  for (std::size_t i = 0; i < parameters.size(); ++i)
    for (std::size_t j = 0; j < at.size(); ++j) at[j] += basis[i] * parameters[i].weights[j];
  return at;
}

const CurveParameter* CurveFit::find(const std::string& key) const {
  const auto found = std::ranges::find(parameters, key, &CurveParameter::key);
  return found == parameters.end() ? nullptr : &*found;
}

double CurveFit::value(const std::string& key) const {
  if (const CurveParameter* parameter = find(key)) return parameter->value;
  throw std::out_of_range("the curve has no parameter " + key);
}

compensation::ThrustCurve CurveFit::curve(std::optional<double> largest_deg,
                                          compensation::OverlapMeasure overlap) const {
  constexpr double kPerRad = 180 / kPi;
  const Radians largest = from_degrees(largest_deg.value_or(points.back().phi_deg));
  std::optional<compensation::ThrustCurve> curve;
  switch (form) {
    case CurveForm::line:
      curve = compensation::ThrustCurve::from_line(ThrustCoefficient(K_T), ThrustCoefficient(value("intercept")),
                                                   value("slope_per_deg") * kPerRad, largest, overlap);
  }
  if (curve) return *curve;
  throw FitError(fmt::format(
      "line fit: K_T = {:.4g} and k of the line at phi = 0, {:.4g} N/(rad/s)^2, must be positive; check the "
      "sign of the thrust and which points carry the line",
      K_T, k_at(0)));
}

Curvature CurveFit::tested(double freedom) const {
  switch (form) {
    case CurveForm::line: {
      std::vector<LinePoint> with_zero = points;
      if (anchored && points.front().phi_deg != 0) with_zero.insert(with_zero.begin(), {0, K_T, K_T_standard_error});
      return curvature(with_zero, freedom);
    }
  }
  return {};
}

std::vector<std::string> CurveFit::remarks(const Estimate& mismatch, double largest_deg) const {
  switch (form) {
    case CurveForm::line:
      return line_remarks(*this, mismatch, largest_deg);
  }
  return {};
}

CurveFit fit_curve(std::span<const LinePoint> points, const LineFitOptions& options) {
  switch (options.form) {
    case CurveForm::line:
      return fit_line(points, options);
  }
  return {};
}

Curvature curvature(std::span<const LinePoint> points, double freedom) {
  Curvature result;
  const double m = static_cast<double>(points.size());
  if (m >= 3 && std::ranges::all_of(points, [](const auto& point) { return point.standard_error > 0; })) {
    std::vector<double> phi, k, weights;
    double scale = 0;
    for (const LinePoint& point : points) scale = std::max(scale, point.phi_deg);
    for (const LinePoint& point : points) {
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
    const double observations = m + (std::isfinite(freedom) ? freedom : 0);
    result.linear_aic = corrected_aic(straight, 2, observations);
    result.quadratic_aic = corrected_aic(parabola.weighted_squares, 3, observations);
  }
  result.lack_of_fit.name = "lack of fit of the line k(phi)";
  result.quadratic.name = "third term of a parabola k(phi)";
  result.lack_of_fit.hypothesis = result.quadratic.hypothesis = "k(phi) is a line";
  result.lack_of_fit.statistic = result.quadratic.statistic = "F";
  return result;
}

}  // namespace kphi::fit
