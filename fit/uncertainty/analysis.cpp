#include "fit/uncertainty/analysis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

namespace kphi::fit {
namespace {

std::vector<double> unit_vector(std::size_t n, std::size_t i) {
  std::vector<double> weights(n);
  weights[i] = 1;
  return weights;
}

std::string name_of_k(double phi_deg) { return phi_deg == 0 ? "K_T" : fmt::format("k({} deg)", phi_deg); }

ErrorSources sources_of(const Identification& identification, std::span<const SpeedDependence> speed,
                        const AnalysisOptions& options) {
  if (options.sources) return *options.sources;
  if (!identification.repeatability.angles.empty())
    return error_sources(identification.repeatability, speed, options.bench);
  std::vector<double> k, errors;
  for (const OcclusionCoefficient& row : identification.table) {
    k.push_back(row.k);
    errors.push_back(row.standard_error);
  }
  return error_sources(std::move(k), errors);
}

bool has_errors(const CurveFit& curve) {
  return std::ranges::all_of(curve.points, [](const CurvePoint& point) { return point.standard_error > 0; });
}

/// Deviation from the curve beyond the errors of its points, once a test has rejected its form. Of points without
/// errors the whole deviation, which is all that is known of them.
BudgetRow curve_row(const CurveFit& curve, const Curvature& curvature) {
  BudgetRow row{.source = fmt::format("{} k(phi)", name_of(curve.form)),
                .unit = kUnitOfK,
                .sensitivity = 1,
                .note = "deviation of its points beyond their errors, where a test finds it"};
  const double n = static_cast<double>(curve.points.size()), spare = curve.spare_points();
  if (!has_errors(curve)) {
    const double squares =
        std::inner_product(curve.residuals.begin(), curve.residuals.end(), curve.residuals.begin(), 0.0);
    row.u = spare > 0 ? std::sqrt(squares / spare) : std::numeric_limits<double>::quiet_NaN();
    row.freedom = spare;
    row.note = "scatter of its points, whose own errors are not given";
    return row;
  }
  if (!curvature.bends()) return row;
  double excess = 0;
  for (std::size_t i = 0; i < curve.points.size(); ++i)
    excess += curve.residuals[i] * curve.residuals[i] / spare - std::pow(curve.points[i].standard_error, 2) / n;
  row.u = std::sqrt(std::max(0.0, excess));
  row.freedom = spare;
  return row;
}

/// How the deviation of points from the form of their curve gets into what is computed from them.
struct Misfit {
  Misfit(const CurveFit& curve, const Curvature& curvature, std::span<const OcclusionCoefficient> table)
      : row(curve_row(curve, curvature)) {
    for (const OcclusionCoefficient& one : table)
      may_miss.push_back(!has_errors(curve) || curve.model().may_miss(curve, one.phi_deg));
  }

  BudgetRow row;  ///< of one point
  std::vector<bool> may_miss;

  [[nodiscard]] double covariance(const std::vector<double>& a, const std::vector<double>& b) const {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      if (may_miss[i]) sum += a[i] * b[i] * row.u * row.u;
    return sum;
  }
  /// Of Σ weights · k, times `scale`, with what k itself may be off the curve if `beside`.
  [[nodiscard]] BudgetRow of(const std::vector<double>& weights, bool beside = false, double scale = 1) const {
    double squares = beside ? 1 : 0;
    for (std::size_t i = 0; i < weights.size(); ++i) squares += may_miss[i] ? weights[i] * weights[i] : 0;
    BudgetRow scaled = row;
    scaled.sensitivity *= std::sqrt(squares) * scale;
    return scaled;
  }
};

/// Of K_T and the parameters; the curve's misfit is in the latter.
std::vector<std::vector<double>> covariance_of(const ErrorSources& sources, const CurveFit& fit, const Misfit& misfit) {
  std::vector<std::vector<double>> functions{unit_vector(fit.parameters.front().weights.size(), 0)};
  for (const CurveParameter& parameter : fit.parameters) functions.push_back(parameter.weights);
  const std::size_t n = functions.size();
  std::vector<std::vector<double>> result(n, std::vector<double>(n));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) {
      result[i][j] = sources.covariance(functions[i], functions[j]);
      if (i > 0 && j > 0) result[i][j] += misfit.covariance(functions[i], functions[j]);
    }
  }
  return result;
}

Budget budget_of(const CurveParameter& parameter, const ErrorSources& sources, const Misfit& misfit) {
  Budget budget = sources.budget(parameter.name, kUnitOfK + parameter.per, parameter.value, parameter.weights);
  budget.rows.push_back(misfit.of(parameter.weights));
  return budget;
}

/// How far k(φ) may bend away between two angles of a table.
BudgetRow between_knots(const compensation::ThrustCurve& curve, double phi_deg, double scale = 1) {
  return {.source = "bend between the angles",
          .evaluation = Evaluation::type_b,
          .u = curve.bend_error_at(from_degrees(phi_deg)),
          .unit = kUnitOfK,
          .sensitivity = scale,
          .note = "by the change of slope at its neighbours"};
}

CurvePrediction predict(const Identification& identification, const ErrorSources& sources, double phi_deg,
                        const Misfit& misfit) {
  const double K_T = identification.thrust_coefficient().value;
  const compensation::ThrustCurve curve = identification.curve();
  const std::vector<double> at = identification.curve_fit.weights_at(phi_deg);
  CurvePrediction prediction;
  prediction.phi_deg = phi_deg;
  const double k = curve.at(from_degrees(phi_deg)).value();
  prediction.k =
      sources.budget(fmt::format("{} at {} deg", name_of(identification.curve_fit.form), phi_deg), kUnitOfK, k, at);
  const bool beside = identification.curve_fit.model().may_miss(identification.curve_fit, phi_deg);
  prediction.k.rows.push_back(misfit.of(at, beside));
  prediction.k.rows.push_back(between_knots(curve, phi_deg));
  prediction.speed_u_share = k > 0 ? 0.5 * prediction.k.combined() / k : std::numeric_limits<double>::infinity();
  std::vector<double> ratio = at;
  for (double& weight : ratio) weight /= K_T;
  ratio.front() -= k / (K_T * K_T);
  prediction.clipped = k >= K_T;
  prediction.scaling_factor =
      sources.budget(fmt::format("k_i({} deg)", phi_deg), "1", curve.scaling_factor(from_degrees(phi_deg)), ratio);
  prediction.scaling_factor.rows.push_back(misfit.of(at, beside, 1 / K_T));
  prediction.scaling_factor.rows.push_back(between_knots(curve, phi_deg, 1 / K_T));
  prediction.extrapolated =
      phi_deg < identification.first_fitted_deg() || phi_deg > identification.curve_fit.points.back().phi_deg;
  return prediction;
}

/// With a piece more or less where a measured φ falls between two.
std::vector<CurveBand> band_of(const Identification& identification, const ErrorSources& sources,
                               const Misfit& misfit) {
  constexpr int kPieces = 80;
  const double widest = identification.table.back().phi_deg;
  std::set<double> angles;
  for (int i = 0; i <= kPieces; ++i) angles.insert(widest * i / kPieces);
  for (const OcclusionCoefficient& one : identification.table) angles.insert(one.phi_deg);
  const compensation::ThrustCurve curve = identification.curve();
  std::vector<CurveBand> band;
  for (const double phi : angles) {
    const std::vector<double> at = identification.curve_fit.weights_at(phi);
    Budget k = sources.budget("", kUnitOfK, identification.curve_fit.k_at(phi), at);
    k.rows.push_back(misfit.of(at));
    k.rows.push_back(between_knots(curve, phi));
    band.push_back({phi, k.value, k.expanded()});
  }
  return band;
}

StraightLine straight_line(const Identification& identification, const ErrorSources& sources, double freedom) {
  CurveOptions options = identification.options.curve;
  options.form = CurveForm::line;
  const CurveFit line = fit_curve(points_of(identification.table), options);
  Curvature test = line.tested(freedom);
  return {budget_of(*line.find("slope_per_deg"), sources, {line, test, identification.table}), test};
}

CurveShape shape_of(const CurveFit& fit, const ErrorSources& sources, const Misfit& misfit) {
  const std::vector<double> at_zero = fit.weights_at(0);
  std::vector<double> difference_weights = at_zero;
  difference_weights.front() -= 1;
  Budget mismatch = sources.budget("k(0) - K_T", kUnitOfK, fit.mismatch(), difference_weights);
  mismatch.rows.push_back(misfit.of(at_zero));
  return {fit.clipping_deg(), fit.zero_crossing_deg(), mismatch.estimate()};
}

std::vector<std::string> remarks_of(const Identification& identification, const Analysis& analysis) {
  std::vector<std::string> remarks;
  for (const OutlyingRun& run : analysis.outlying)
    remarks.push_back(fmt::format(
        "repetition {} at {}° stands out, {:+.2f} % from the others ({}): it is kept, and its scatter is in the "
        "budget of every k; look for a cause and repeat this occlusion",
        run.repetition, run.phi_deg, 100 * run.share, std::isnan(run.p) ? "Hampel" : fmt::format("p = {:.2g}", run.p)));
  if (identification.alone()) return remarks;
  for (std::string& remark :
       identification.curve_fit.remarks(analysis.shape.mismatch, identification.table.back().phi_deg))
    remarks.push_back(std::move(remark));
  if (const auto& floor = analysis.flight.error.carries_to_deg)
    remarks.push_back(
        fmt::format("from {:.0f}° on a rotor keeps less than a tenth of its thrust: nothing flies on it there, and the "
                    "verdict is for "
                    "the angles below",
                    *floor));
  return remarks;
}

std::vector<RejectedPoint> rejected_points(const Identification& identification) {
  std::vector<RejectedPoint> rejected;
  for (const OcclusionCoefficient& row : identification.table) {
    if (!row.fit) continue;
    for (std::size_t i = 0; i < row.measured.size(); ++i) {
      if (row.fit->robust_weights[i] >= kRejectedWeight) continue;
      const results::StepMean& step = row.measured[i];
      rejected.push_back({row.phi_deg, step.repetition, step.step, step.speed_rad_s, step.thrust_n,
                          row.fit->residuals_n[i], row.fit->robust_weights[i]});
    }
  }
  return rejected;
}

std::vector<HypothesisTest> neighbour_tests(const std::vector<Budget>& coefficients, const ErrorSources& sources,
                                            const Identification& identification) {
  std::vector<HypothesisTest> tests;
  for (std::size_t i = 1; i < coefficients.size(); ++i) {
    std::vector<double> weights(coefficients.size());
    weights[i - 1] = 1;
    weights[i] = -1;
    const double value = coefficients[i - 1].value - coefficients[i].value;
    HypothesisTest test = student_test(sources.budget("", kUnitOfK, value, weights).estimate(), 0);
    test.name = fmt::format("k({} deg) against k({} deg)", identification.table[i - 1].phi_deg,
                            identification.table[i].phi_deg);
    test.hypothesis = "both are the same";
    tests.push_back(test);
  }
  return tests;
}

std::vector<Budget> standard_air(const Identification& identification, const std::vector<Budget>& coefficients,
                                 const std::optional<double>& u) {
  std::vector<Budget> result;
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    const auto& air = identification.table[i].air;
    if (!air) return {};
    const double scale = kStandardDensity / air->value;
    Budget budget = coefficients[i];
    budget.quantity += " in standard air";
    budget.value *= scale;
    for (BudgetRow& row : budget.rows) row.sensitivity *= scale;
    budget.rows.push_back({.source = "air density",
                           .evaluation = Evaluation::type_b,
                           .u = u.value_or(std::numeric_limits<double>::quiet_NaN()),
                           .unit = "1",
                           .sensitivity = -budget.value,
                           .common = true,
                           .note = u ? "" : "unknown"});
    result.push_back(std::move(budget));
  }
  return result;
}

/// What is known of the curve. Call it with the coefficients.
void take_curve(const Identification& identification, const ErrorSources& sources, const AnalysisOptions& options,
                Analysis& analysis) {
  const double freedom = !identification.repeatability.angles.empty() ? identification.repeatability.freedom()
                                                                      : std::numeric_limits<double>::infinity();
  const CurveFit& fit = identification.curve_fit;
  analysis.curvature = fit.tested(freedom);
  analysis.line = straight_line(identification, sources, freedom);
  const Misfit misfit(fit, analysis.curvature, identification.table);
  for (const CurveParameter& parameter : fit.parameters)
    analysis.parameters.push_back(budget_of(parameter, sources, misfit));
  analysis.covariance = covariance_of(sources, fit, misfit);
  for (const double phi : options.prediction_deg)
    analysis.predictions.push_back(predict(identification, sources, phi, misfit));
  analysis.band = band_of(identification, sources, misfit);
  analysis.shape = shape_of(fit, sources, misfit);
  if (const double u = analysis.coefficients.front().combined(); std::isnan(u))
    analysis.covariance[0][0] = analysis.shape.mismatch.u = u;
}

}  // namespace

Analysis analyse(const Identification& identification, const AnalysisOptions& options) {
  Analysis analysis;
  std::vector<double> phis;
  for (const OcclusionCoefficient& row : identification.table) phis.push_back(row.phi_deg);
  const bool from_steps = !identification.repeatability.angles.empty();
  if (from_steps) analysis.speed = speed_dependence(identification.table, identification.repeatability.zero_movement);
  analysis.trend = speed_trend(identification, analysis.speed);
  const ErrorSources sources = sources_of(identification, analysis.speed, options);
  for (std::size_t i = 0; i < phis.size(); ++i)
    analysis.coefficients.push_back(
        sources.budget(name_of_k(phis[i]), kUnitOfK, identification.table[i].k, unit_vector(phis.size(), i)));

  if (!identification.alone()) take_curve(identification, sources, options, analysis);
  analysis.standard = standard_air(identification, analysis.coefficients, options.bench.air_density);
  analysis.differences = neighbour_tests(analysis.coefficients, sources, identification);
  analysis.between_runs = identification.repeatability.between;
  analysis.outlying = outlying_runs(identification.selection.used);
  analysis.flight =
      flight_readiness(identification,
                       {analysis.speed, analysis.curvature, analysis.outlying, analysis.differences, analysis.trend,
                        sources_of(identification, {}, options), options.bench.air_density},
                       options.limits);
  analysis.remarks = remarks_of(identification, analysis);
  analysis.rejected = rejected_points(identification);
  if (from_steps) analysis.torque = torque_coefficients(identification, options.bench);
  return analysis;
}

}  // namespace kphi::fit
