// Least squares of thrust on squared speed: one propeller, one occlusion, one k.
//
// T is fitted on ω²; T/ω² is never averaged over the steps, because at low speed thrust is under the load cell's noise
// and such an average gives that noise the largest weight.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include "fit/thrust_model.hpp"

namespace kphi::fit {

struct Point {
  double speed_rad_s = 0;
  double thrust_n = 0;
  double weight = 1;  ///< of the squared residual, > 0
};

/// Which terms of thrust() are free; the others are zero.
enum class ThrustForm {
  through_origin,  ///< k
  with_offset,     ///< k and offset
  three_terms,     ///< k, linear and offset
};

struct ThrustFitOptions {
  ThrustForm form = ThrustForm::through_origin;
  double speed_min_rad_s = 0;  ///< points below are left out
  double speed_max_rad_s = std::numeric_limits<double>::infinity();
};

struct ThrustFit {
  ThrustParameters<double> parameters;
  /// Standard errors from Ceres' covariance times the residual variance Σ w r²/(n − p). They hold what scatters from
  /// point to point, not what all points have in common (zero, calibration, air density).
  ThrustParameters<double> standard_error;
  double rms_n = 0;      ///< sqrt(Σ w r²/(n − p)), N
  double r_squared = 0;  ///< 1 − Σ w r²/Σ w (T − mean T)²
  std::size_t n = 0;
  double speed_min_rad_s = 0;  ///< of the points used
  double speed_max_rad_s = 0;
  std::vector<Point> points;        ///< used, in the order given
  std::vector<double> residuals_n;  ///< T − thrust(parameters, ω), one per point used
};

/// Throws FitError when fewer points than free terms + 1 remain in the speed range, when a number is not finite, a
/// weight not positive, or when the points cannot tell the terms apart.
[[nodiscard]] ThrustFit fit_thrust(std::span<const Point> points, const ThrustFitOptions& options = {});

/// k at one named speed, next to the k fitted over a range: on real propellers the two differ, k rises with speed.
struct SpeedCoefficient {
  double k = 0;  ///< mean of T/ω² over the repetitions, N/(rad/s)²
  /// s/√n of the repetitions; quiet NaN from one repetition.
  double standard_error = std::numeric_limits<double>::quiet_NaN();
  double speed_rad_s = 0;  ///< mean measured speed
  std::size_t repetitions = 0;
};

/// `points`: one per repetition, all measured at the same commanded speed. Throws FitError when there is none or one
/// has no speed.
[[nodiscard]] SpeedCoefficient k_at_speed(std::span<const Point> points);

}  // namespace kphi::fit
