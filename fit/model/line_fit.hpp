// The line k(φ) = intercept + slope φ through the coefficients of the occlusions (paper, "Results of the
// Identification": the orange line).
//
// By default it goes freely through the occluded points, φ > 0, and K_T = k(0) is separate. φ = 0 is not collinear with
// them: the paper's own numbers (1, 0.90 at 45°, 0.25 at 270°) have slope −0.22 %/° up to 45° and −0.29 %/° beyond, so
// a line pulled to K_T would miss every occluded point. Anchored, the line starts at K_T: k does not jump at first
// contact, but the residual is larger.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "compensation/thrust_curve.hpp"
#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

struct LinePoint {
  double phi_deg = 0;
  double k = 0;               ///< N/(rad/s)²
  double standard_error = 0;  ///< of k; 0 or NaN: unknown
};

/// Forms of k(φ). What depends on the form is a switch over all of them in line_fit.cpp, and a function for each form
/// where one is visited: where a further form is missing does not compile.
enum class CurveForm : std::uint8_t { line };

/// "line": for people, and the key in coefficients.yaml.
[[nodiscard]] const char* name_of(CurveForm form);

struct Curvature {
  static constexpr double kNotComputed = std::numeric_limits<double>::quiet_NaN();
  HypothesisTest lack_of_fit;          ///< of the line: χ²/(m − 2) against the variance of the coefficients
  HypothesisTest quadratic;            ///< F test of the parabola's third term
  double second_order = kNotComputed;  ///< N/(rad/s)²/deg², of the parabola
  double second_order_u = kNotComputed;
  /// Corrected for small samples (AICc); the lower one describes better.
  double linear_aic = kNotComputed, quadratic_aic = kNotComputed;
  [[nodiscard]] bool bends() const { return lack_of_fit.rejected() || quadratic.rejected(); }
};

/// Tests whether k(φ) is a line, by the `points` that carry it (with φ = 0 if anchored) and their standard errors;
/// `freedom` of the variance behind those errors. Needs 3 points; with 3 the two tests are the same.
[[nodiscard]] Curvature curvature(std::span<const LinePoint> points, double freedom);

struct LineFitOptions {
  CurveForm form = CurveForm::line;
  bool anchored = false;             ///< the intercept is K_T
  std::vector<double> points_deg{};  ///< which points carry the line; empty: all with φ > 0
};

/// One parameter of the curve.
struct CurveParameter {
  std::string key;   ///< in coefficients.yaml: "intercept", "slope_per_deg"
  std::string name;  ///< for people
  std::string per;   ///< what follows the unit of k: "", "/deg"
  double value = 0;
  /// The value is Σ weight · k over all the points given to the fit, ascending φ, with the weights of the fit.
  std::vector<double> weights{};
};

/// k(φ) as fitted: a linear function of its parameters. What comes after the fit asks for k, weights and parameters and
/// does not know the form.
struct CurveFit {
  CurveForm form = CurveForm::line;
  bool anchored = false;  ///< k(0) of the curve is K_T
  std::vector<CurveParameter> parameters;
  std::vector<LinePoint> points;  ///< used, ascending φ
  std::vector<double> residuals;  ///< k − curve, N/(rad/s)², one per point used
  std::vector<double> sigmas;     ///< the errors by which the points were weighted
  double K_T = 0;                 ///< N/(rad/s)², measured at φ = 0
  double K_T_standard_error = 0;

  /// The curve that flies up to `largest_deg` (default: the last point), without its uncertainty, which Analysis has.
  /// Throws FitError if K_T or k(0) of the curve is not positive, or a number not finite.
  [[nodiscard]] compensation::ThrustCurve curve(
      std::optional<double> largest_deg = {},
      compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc) const;
  /// k(φ) = Σ basis · value over the parameters.
  [[nodiscard]] std::vector<double> basis_at(double phi_deg) const;
  [[nodiscard]] double k_at(double phi_deg) const;
  /// k(φ) = Σ weight · k over all the points given to the fit.
  [[nodiscard]] std::vector<double> weights_at(double phi_deg) const;
  /// nullptr if the curve has no such parameter.
  [[nodiscard]] const CurveParameter* find(const std::string& key) const;
  /// Throws std::out_of_range if the curve has no such parameter.
  [[nodiscard]] double value(const std::string& key) const;
  /// k(0) − K_T: by how much the curve misses the measured k(0).
  [[nodiscard]] double mismatch() const { return k_at(0) - K_T; }
  /// φ where the curve meets K_T; below it the curve is above K_T and compensation clips. nullopt unless it falls.
  [[nodiscard]] std::optional<double> clipping_deg() const { return falls_to(K_T); }
  /// φ where the curve predicts no thrust at all. nullopt unless it falls.
  [[nodiscard]] std::optional<double> zero_crossing_deg() const { return falls_to(0); }
  [[nodiscard]] std::optional<double> falls_to(double k) const;
  /// Of the form, by the points that carry it; see curvature().
  [[nodiscard]] Curvature tested(double freedom) const;
  /// What a pilot should know of the form: intercept beside K_T, clipping, zero. `mismatch` is that of k(0) with its
  /// error, `largest_deg` the widest occlusion measured.
  [[nodiscard]] std::vector<std::string> remarks(const Estimate& mismatch, double largest_deg) const;
};

/// `points` hold exactly one φ = 0 (K_T) and the occluded ones, each φ once. Throws FitError when K_T is missing, a φ
/// is listed twice or not measured, or too few points remain (free: 2, anchored: 1 with φ > 0).
[[nodiscard]] CurveFit fit_curve(std::span<const LinePoint> points, const LineFitOptions& options = {});

}  // namespace kphi::fit
