// The analysis of one identification: budgets, tests, intervals, torque.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fit/model/curve_fit.hpp"
#include "fit/model/identification.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "fit/uncertainty/budget.hpp"
#include "fit/uncertainty/readiness.hpp"
#include "fit/uncertainty/speed_dependence.hpp"
#include "fit/uncertainty/speed_trend.hpp"
#include "fit/uncertainty/torque_coefficient.hpp"

namespace kphi::fit {

struct AnalysisOptions {
  BenchUncertainty bench;
  ReadinessLimits limits;
  std::optional<ErrorSources> sources{};  ///< of a flight: instead of those of bench and steps
  std::vector<double> prediction_deg{0, 15, 30, 45, 60, 75, 90, 120, 135, 150, 180, 210, 240, 270};
};

/// A point that the robust loss nearly ignored.
struct RejectedPoint {
  double phi_deg = 0;
  int repetition = 0, step = 0;
  double speed_rad_s = 0, thrust_n = 0;
  double residual_n = 0;
  double robust_weight = 0;  ///< 1: believed, 0: ignored
};

/// The curve at one φ of a grid, with its whole uncertainty.
struct CurvePrediction {
  double phi_deg = 0;
  Budget k;               ///< of the curve, N/(rad/s)²
  Budget scaling_factor;  ///< k_i as it flies (science.md, eq. 2); errors common to all k cancel
  /// Relative standard uncertainty of ω̂ = sqrt(T/k) for a given T: half that of k. 1.
  double speed_u_share = 0;
  bool clipped = false;       ///< the curve lies above K_T here, k_i is held at 1
  bool extrapolated = false;  ///< outside the occlusions that carry the curve
};

/// The curve itself, for a drawing.
struct CurveBand {
  double phi_deg = 0;
  double k = 0;         ///< N/(rad/s)²
  double expanded = 0;  ///< half of the 95 % interval
};

/// A line through the points of the curve, whatever its form: for statements on the slope.
struct StraightLine {
  Budget slope;    ///< N/(rad/s)²/deg
  Curvature test;  ///< whether k(φ) is a line
};

/// Where the curve meets K_T and 0: what equation 4 makes of it.
struct CurveShape {
  std::optional<double> clipping_deg;  ///< below, the curve is above K_T
  std::optional<double> zero_deg;      ///< there it predicts no thrust
  Estimate mismatch;                   ///< k(0) − K_T
};

struct Analysis {
  std::vector<Budget> coefficients;             ///< one per row of the table: k(φ)
  std::vector<Budget> parameters;               ///< of the curve, as CurveFit::parameters
  std::vector<Budget> standard;                 ///< k(φ) in standard air, one per row; empty if the air is unknown
  std::vector<std::vector<double>> covariance;  ///< of K_T and the parameters; NaN: unknown
  std::vector<SpeedDependence> speed;           ///< one per φ
  std::optional<SpeedTrend> trend;              ///< of k with the speed, if there is one
  Curvature curvature;                          ///< of the curve's form
  StraightLine line;
  std::vector<HypothesisTest> differences;  ///< Student tests between neighbouring occlusions
  std::vector<CurvePrediction> predictions;
  std::vector<CurveBand> band;  ///< ascending from φ = 0 to the widest occlusion, each measured φ among them
  std::vector<TorqueCoefficient> torque;
  std::vector<RejectedPoint> rejected;
  std::vector<OutlyingRun> outlying;  ///< kept; each also gives a remark
  /// Relative scatter of k between runs beyond what noise and zero explain, pooled over φ; its freedom.
  Estimate between_runs;
  CurveShape shape;
  FlightReadiness flight;
  std::vector<std::string> remarks;  ///< sentences on the curve: clipping, zero, extrapolation, mismatch
};

/// One fitted propeller.
struct Fitted {
  Identification identification;
  Analysis analysis;
};

/// From a table of coefficients without steps: what the table allows.
[[nodiscard]] Analysis analyse(const Identification& identification, const AnalysisOptions& options = {});

}  // namespace kphi::fit
