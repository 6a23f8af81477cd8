// Everything that can be said about one identification beyond its numbers: budgets, tests, intervals, torque.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/model/identification.hpp"
#include "fit/model/torque.hpp"
#include "fit/numerics/budget.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/bench_uncertainty.hpp"
#include "fit/uncertainty/bootstrap.hpp"
#include "fit/uncertainty/curvature.hpp"
#include "fit/uncertainty/speed_dependence.hpp"

namespace kphi::fit {

struct AnalysisOptions {
  BenchUncertainty bench;
  /// Of the air in which all was measured; its relative standard uncertainty is BenchUncertainty::air_density.
  std::optional<double> air_density_kg_m3;
  BootstrapOptions bootstrap;
  std::vector<double> prediction_deg{0, 15, 30, 45, 60, 75, 90, 120, 150, 180, 210, 240, 270};
};

/// A point that the robust loss all but ignored.
struct RejectedPoint {
  double phi_deg = 0;
  int repetition = 0, step = 0;
  double speed_rad_s = 0, thrust_n = 0;
  double residual_n = 0;
  double robust_weight = 0;  ///< 1: believed, 0: ignored
};

/// What the line gives at one φ of a grid, with the error of everything behind it.
struct LinePrediction {
  double phi_deg = 0;
  Budget k;               ///< of the line, N/(rad/s)²
  Budget scaling_factor;  ///< k_i as it flies, ScalingLaw::clamped; what is common to all k cancels
  /// Relative standard uncertainty of ω̂ = sqrt(T/k) for a given T: half that of k. 1.
  double speed_u_share = 0;
  bool clipped = false;       ///< the line lies above K_T here, k_i is held at 1
  bool extrapolated = false;  ///< outside the occlusions that carry the line
};

/// Where the line meets K_T and 0, in words and numbers: what equation 4 does with it.
struct LineShape {
  std::optional<double> clipping_deg;  ///< below, the line is above K_T
  std::optional<double> zero_deg;      ///< there it predicts no thrust
  Estimate mismatch;                   ///< intercept − K_T
};

struct Analysis {
  std::vector<Budget> coefficients;  ///< one per row of the table: k(φ)
  Budget intercept, slope;
  std::vector<Budget> standard;  ///< k(φ) in standard air, one per row; empty where the air is not known
  std::vector<std::vector<double>> covariance;  ///< of K_T, intercept, slope, with what is common to all k
  std::vector<SpeedDependence> speed;           ///< one per φ
  Curvature curvature;
  std::vector<HypothesisTest> differences;  ///< Student tests between neighbouring occlusions
  std::vector<LinePrediction> predictions;
  std::vector<BootstrapInterval> bootstrap;
  std::vector<TorqueCoefficient> torque;
  std::vector<RejectedPoint> rejected;
  std::vector<OutlyingRun> outlying;  ///< kept; each is a remark, too
  /// Relative scatter of k between runs beyond what noise and zero explain, pooled over φ; its freedom.
  Estimate between_runs;
  LineShape shape;
  std::vector<std::string> remarks;  ///< sentences on the line: clipping, zero, extrapolation, mismatch
};

/// Of an identification from steps. From a table of coefficients only what the table allows.
[[nodiscard]] Analysis analyse(const Identification& identification, const AnalysisOptions& options = {});

}  // namespace kphi::fit
