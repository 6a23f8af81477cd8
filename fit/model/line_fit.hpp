// The line k(φ) = intercept + slope φ through the coefficients of the occlusions (paper, "Results of the
// Identification": the orange line).
//
// By default it goes freely through the occluded points, φ > 0, and K_T = k(0) is separate. φ = 0 is not collinear with
// them: the paper's own numbers (1, 0.90 at 45°, 0.25 at 270°) have slope −0.22 %/° up to 45° and −0.29 %/° beyond, so
// a line pulled to K_T would miss every occluded point. Anchored, the line starts at K_T: k does not jump at first
// contact, but the residual is larger.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "compensation/thrust_curve.hpp"
#include "fit/numerics/hypothesis_test.hpp"

namespace kphi::fit {

struct LinePoint {
  double phi_deg = 0;
  double k = 0;               ///< N/(rad/s)²
  double standard_error = 0;  ///< of k; 0 or NaN: unknown
};

struct LineFitOptions {
  bool anchored = false;             ///< the intercept is K_T
  std::vector<double> points_deg{};  ///< which points carry the line; empty: all with φ > 0
};

struct LineWeights {
  std::vector<double> intercept, slope;  ///< one per φ; slope per degree
};

struct LineFit {
  bool anchored = false;
  double intercept = 0;      ///< N/(rad/s)²
  double slope_per_deg = 0;  ///< N/(rad/s)² per degree
  /// Of (intercept, slope_per_deg). (JᵀJ)⁻¹ of residuals in units of their standard errors, enlarged by χ²/(n − p)
  /// where that is above 1 (scatter about the line larger than the errors explain). Anchored: with the error of K_T
  /// carried through to the slope.
  std::array<std::array<double, 2>, 2> covariance{};
  std::vector<LinePoint> points;  ///< used, ascending φ
  std::vector<double> residuals;  ///< k − line, N/(rad/s)², one per point used
  std::vector<double> sigmas;     ///< the errors by which the points were weighted
  double K_T = 0;                 ///< N/(rad/s)², measured at φ = 0
  double K_T_standard_error = 0;

  /// The curve that flies: k(φ), its error and K_T, up to `largest_deg` (default: the last point). Throws FitError if
  /// K_T or the intercept is not positive, or a number not finite.
  [[nodiscard]] compensation::ThrustCurve curve(
      std::optional<double> largest_deg = {},
      compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc) const;
  /// intercept − K_T: by how much the line misses the measured k(0).
  [[nodiscard]] double mismatch() const { return intercept - K_T; }
  /// φ where the line meets K_T; below it the line is above K_T and compensation clips. nullopt unless the slope is
  /// negative.
  [[nodiscard]] std::optional<double> clipping_deg() const;
  /// φ where the line predicts no thrust at all. nullopt unless the slope is negative.
  [[nodiscard]] std::optional<double> zero_crossing_deg() const;
  /// The line as a linear function of the coefficients: intercept and slope are Σ weight · k over `phis_deg` (of the
  /// whole table, φ = 0 first), with the weights of the fit.
  [[nodiscard]] LineWeights weights(std::span<const double> phis_deg) const;
};

/// `points` hold exactly one φ = 0 (K_T) and the occluded ones, each φ once. Throws FitError when K_T is missing, a φ
/// is listed twice or not measured, or too few points remain (free: 2, anchored: 1 with φ > 0).
[[nodiscard]] LineFit fit_line(std::span<const LinePoint> points, const LineFitOptions& options = {});

struct Curvature {
  HypothesisTest lack_of_fit;  ///< of the line: χ²/(m − 2) against the variance of the coefficients
  HypothesisTest quadratic;    ///< F test of the parabola's third term
  double second_order = 0;     ///< N/(rad/s)²/deg², of the parabola
  double second_order_u = 0;
  double linear_aic = 0, quadratic_aic = 0;  ///< corrected for small samples (AICc); the lower one describes better
  [[nodiscard]] bool bends() const { return lack_of_fit.rejected() || quadratic.rejected(); }
};

/// Tests whether k(φ) is a line, by the `points` that carry it (with φ = 0 if anchored) and their standard errors;
/// `freedom` of the variance behind those errors. Needs 3 points; with 3 the two tests are the same.
[[nodiscard]] Curvature curvature(std::span<const LinePoint> points, double freedom);

}  // namespace kphi::fit
