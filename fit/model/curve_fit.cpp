#include "fit/model/curve_fit.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "base/error.hpp"

namespace kphi::fit {
namespace {

/// No k is weighted as if known better than this share of the largest |k|: mounting and air change it by at least as
/// much between two runs. Also used where a standard error is unknown.
constexpr double kErrorFloor = 1e-3;

const CurveModel& model_of(CurveForm form) {
  switch (form) {
    case CurveForm::line:
      return line_model();
    case CurveForm::table:
      return table_model();
  }
  throw std::logic_error("no such form of k(phi)");
}

std::vector<CurvePoint> sorted(std::span<const CurvePoint> points, const char* form) {
  std::vector<CurvePoint> result(points.begin(), points.end());
  std::ranges::sort(result, {}, &CurvePoint::phi_deg);
  for (std::size_t i = 0; i < result.size(); ++i) {
    if (!std::isfinite(result[i].phi_deg) || !std::isfinite(result[i].k))
      throw FitError(fmt::format("{} fit: an angle or a coefficient is not a number", form));
    if (i > 0 && result[i].phi_deg - result[i - 1].phi_deg < kSameAngleDeg)
      throw FitError(fmt::format("{} fit: phi = {}° is listed twice", form, result[i].phi_deg));
  }
  return result;
}

const CurvePoint& point_at(const std::vector<CurvePoint>& points, double phi_deg, const char* form) {
  for (const CurvePoint& point : points)
    if (std::abs(point.phi_deg - phi_deg) < kSameAngleDeg) return point;
  std::vector<double> measured;
  for (const CurvePoint& point : points) measured.push_back(point.phi_deg);
  throw FitError(
      fmt::format("{} fit: phi = {}° was not measured; measured are {}°", form, phi_deg, fmt::join(measured, ", ")));
}

std::vector<CurvePoint> carriers(const std::vector<CurvePoint>& points, const CurveOptions& options) {
  const char* const form = name_of(options.form);
  std::vector<CurvePoint> used;
  if (options.points_deg.empty()) {
    std::copy_if(points.begin(), points.end(), std::back_inserter(used),
                 [](const CurvePoint& point) { return point.phi_deg > kSameAngleDeg; });
  }
  for (const double phi : options.points_deg) used.push_back(point_at(points, phi, form));
  used = sorted(used, form);
  const std::size_t needed = model_of(options.form).least_points(options.anchored);
  const auto occluded = std::ranges::count_if(used, [](const auto& p) { return p.phi_deg > kSameAngleDeg; });
  if (used.size() < needed || occluded < 1) {
    throw FitError(
        fmt::format("{0} fit: {1} points for the {0}, but it needs {2} with phi > 0; measure more occlusions{3}", form,
                    used.size(), needed, options.anchored ? "" : fmt::format(" or anchor the {} at K_T", form)));
  }
  if (const std::size_t most = model_of(options.form).most_points(); static_cast<std::size_t>(occluded) > most)
    throw FitError(fmt::format("{0} fit: {1} occlusions, but a {0} holds {2} beside phi = 0; choose them with --points",
                               form, occluded, most));
  return used;
}

/// Without its error nobody can say how far a point is from the curve.
void require_loss_to_fit(const CurveOptions& options, const std::vector<CurvePoint>& used) {
  if (options.loss == Loss::none) return;
  if (!model_of(options.form).can_have_loss())
    throw FitError(
        fmt::format("{0} fit: a {0} passes through its points and has no robust loss; fit a line, or leave "
                    "--curve-loss away",
                    name_of(options.form)));
  for (const CurvePoint& point : used) {
    if (!(point.standard_error > 0))
      throw FitError(
          fmt::format("{} fit: the error of k at phi = {}° is unknown, and the {} loss is scaled by it; "
                      "give it in a column u_k_…, or leave --curve-loss away",
                      name_of(options.form), point.phi_deg, name_of(options.loss)));
  }
}

double largest_k(const std::vector<CurvePoint>& points, const char* form) {
  double largest = 0;
  for (const CurvePoint& point : points) largest = std::max(largest, std::abs(point.k));
  if (largest == 0) throw FitError(fmt::format("{} fit: every coefficient is 0", form));
  return largest;
}

}  // namespace

const char* name_of(CurveForm form) { return model_of(form).name(); }

const CurveModel& CurveFit::model() const { return model_of(form); }

std::optional<double> CurveFit::falls_to(double k) const { return model().falls_to(*this, k); }

Curvature CurveFit::tested(double freedom) const { return model().tested(*this, freedom); }

double CurveFit::spare_points() const {
  return static_cast<double>(points.size()) - static_cast<double>(model().terms(*this));
}

std::vector<std::string> CurveFit::remarks(const Estimate& mismatch, double largest_deg) const {
  return model().remarks(*this, mismatch, largest_deg);
}

double CurveFit::k_at(double phi_deg) const {
  double k = 0;
  const std::vector<double> basis = model().basis(*this, phi_deg);
  for (std::size_t i = 0; i < parameters.size(); ++i) k += basis[i] * parameters[i].value;
  return k;
}

std::vector<double> CurveFit::weights_at(double phi_deg) const {
  std::vector<double> at(parameters.front().weights.size());
  const std::vector<double> basis = model().basis(*this, phi_deg);
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
  const Radians largest = from_degrees(largest_deg.value_or(points.back().phi_deg));
  if (const auto curve = model().flown(*this, largest, overlap)) return *curve;
  throw FitError(fmt::format(
      "{0} fit: K_T = {1:.4g} and k of the {0} at phi = 0, {2:.4g} N/(rad/s)^2, must be positive; check the "
      "sign of the thrust and which points carry the {0}",
      name_of(form), K_T, k_at(0)));
}

CurveFit fit_curve(std::span<const CurvePoint> points, const CurveOptions& options) {
  const char* const form = name_of(options.form);
  const std::vector<CurvePoint> all = sorted(points, form);
  if (all.empty() || std::abs(all.front().phi_deg) > kSameAngleDeg)
    throw FitError(
        fmt::format("{} fit: no run at phi = 0; K_T is measured without an occlusion on the same stand", form));

  const bool anchored = model_of(options.form).anchored(options.anchored);
  CurveFit fit{.form = options.form, .anchored = anchored, .loss = options.loss, .K_T = all.front().k};
  const double floor = kErrorFloor * largest_k(all, form);
  const auto known_error = [&](const CurvePoint& point) {
    return point.standard_error > 0 ? point.standard_error : floor;
  };
  fit.K_T_standard_error = known_error(all.front());
  fit.points = carriers(all, options);
  require_loss_to_fit(options, fit.points);
  for (const CurvePoint& point : fit.points) fit.sigmas.push_back(std::max(known_error(point), floor));
  fit.parameters = model_of(options.form).parameters(fit, all);
  for (std::size_t i = 0; i < fit.points.size(); ++i) {
    fit.residuals.push_back(fit.points[i].k - fit.k_at(fit.points[i].phi_deg));
    fit.robust_weights.push_back(robust_weight(fit.loss, fit.residuals[i] / fit.sigmas[i]));
  }
  return fit;
}

}  // namespace kphi::fit
