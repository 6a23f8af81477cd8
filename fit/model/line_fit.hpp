// The line k(φ) = intercept + slope φ through the coefficients of the occlusions (paper, "Results of the
// Identification": the orange line).
//
// By default it goes freely through the occluded points, φ > 0, and K_T = k(0) stands beside it. φ = 0 is not collinear
// with them: the paper's own numbers (1, 0.90 at 45°, 0.25 at 270°) have slope −0.22 %/° up to 45° and −0.29 %/°
// beyond, so a line pulled to K_T misses every occluded point, and those are the ones it is flown with. Anchored, the
// line starts at K_T instead: no jump of k at first contact, paid for with a larger residual.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <vector>

#include "compensation/thrust_curve.hpp"

namespace kphi::fit {

struct LinePoint {
  double phi_deg = 0;
  double k = 0;               ///< N/(rad/s)²
  double standard_error = 0;  ///< of k; 0 or NaN: not known
};

struct LineFitOptions {
  bool anchored = false;             ///< the intercept is K_T
  std::vector<double> points_deg{};  ///< which points carry the line; empty: all with φ > 0
  /// A k is never weighted as if it were known better than this share of the largest |k| (0.1 %: what mounting and
  /// air change between two runs at the very least). Also taken where a standard error is not known.
  double error_floor = 1e-3;
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

  /// What flies: k(φ), its error and K_T, up to `largest_deg` (default: the last point). Throws FitError if K_T or the
  /// intercept is not positive, or a number not finite.
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
  /// The line as the linear function of the coefficients that it is: intercept and slope are Σ weight · k over
  /// `phis_deg` (of the whole table, φ = 0 first), for weights as they were in the fit.
  [[nodiscard]] LineWeights weights(std::span<const double> phis_deg) const;
};

/// `points` hold exactly one φ = 0 (K_T) and the occluded ones, each φ once. Throws FitError when K_T is missing, a φ
/// is listed twice or not measured, or too few points remain (free: 2, anchored: 1 with φ > 0).
[[nodiscard]] LineFit fit_line(std::span<const LinePoint> points, const LineFitOptions& options = {});

}  // namespace kphi::fit
