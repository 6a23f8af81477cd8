// Everything that can be said about one identification beyond its numbers: budgets, tests, intervals, torque.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/air.hpp"
#include "fit/bench_uncertainty.hpp"
#include "fit/bootstrap.hpp"
#include "fit/budget.hpp"
#include "fit/curvature.hpp"
#include "fit/identification.hpp"
#include "fit/line_prediction.hpp"
#include "fit/speed_dependence.hpp"
#include "fit/statistical_test.hpp"
#include "fit/torque.hpp"

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
  std::vector<StatisticalTest> differences;  ///< Student tests between neighbouring occlusions
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

/// One table of budgets against another, φ by φ, by Welch's test: the same propeller on two set-ups, or on two days.
/// Whole uncertainties count: what neither bench knows of its cell or clock is missing in both.
[[nodiscard]] std::vector<StatisticalTest> compare_setups(const Analysis& one, const Analysis& other);

/// Of an identification from steps. From a table of coefficients only what the table allows.
[[nodiscard]] Analysis analyse(const Identification& identification, const AnalysisOptions& options = {});

}  // namespace kphi::fit
