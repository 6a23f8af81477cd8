// Everything that can be said about one identification beyond its numbers: budgets, tests, intervals, torque.
#pragma once

#include <string>
#include <vector>

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

struct Analysis {
  std::vector<Budget> coefficients;  ///< one per row of the table: k(φ)
  Budget intercept, slope;
  std::vector<SpeedDependence> speed;  ///< one per φ
  Curvature curvature;
  std::vector<StatisticalTest> differences;  ///< Student tests between neighbouring occlusions
  std::vector<LinePrediction> predictions;
  std::vector<BootstrapInterval> bootstrap;
  std::vector<TorqueCoefficient> torque;
  std::vector<RejectedPoint> rejected;
  /// Relative scatter of k between runs beyond what noise and zero explain, pooled over φ; its freedom.
  Estimate between_runs;
  std::vector<std::string> remarks;  ///< sentences on the line: clipping, zero, extrapolation, mismatch
};

/// Of an identification from steps. From a table of coefficients only what the table allows.
[[nodiscard]] Analysis analyse(const Identification& identification, const AnalysisOptions& options = {});

}  // namespace kphi::fit
