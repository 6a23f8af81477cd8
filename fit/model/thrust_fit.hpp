// Least squares of thrust on squared speed: one propeller, one occlusion, one k (science.md, eq. 1 and 12).
//
// T is fitted on ω²; T/ω² is never averaged over the steps, because at low speed thrust is under the load cell's noise
// and such an average gives that noise the largest weight.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "fit/numerics/loss.hpp"

namespace kphi::fit {

/// T = k ω² + linear ω + offset. The paper's model (equations 2 and 3) is k alone; flight stacks also use all three
/// terms. Scalar is double, or a Ceres Jet while fitting.
template <class Scalar>
struct ThrustParameters {
  Scalar k{};       ///< N/(rad/s)²
  Scalar linear{};  ///< N/(rad/s)
  Scalar offset{};  ///< N
};

/// Thrust in N at `speed` in rad/s; the same form holds in any consistently scaled units.
template <class Scalar>
[[nodiscard]] constexpr Scalar thrust(const ThrustParameters<Scalar>& parameters, double speed) {
  return (parameters.k * speed + parameters.linear) * speed + parameters.offset;
}

struct Point {
  double speed_rad_s = 0;
  double thrust_n = 0;
  double weight = 1;         ///< of the squared residual, > 0
  double u_thrust_n = 0;     ///< standard uncertainty of the mean; 0: unknown
  double u_speed_rad_s = 0;  ///< the same
};

/// Which terms of thrust() are free, and how many; the others are zero.
enum class ThrustForm : std::uint8_t {
  through_origin = 1,  ///< k
  with_offset = 2,     ///< k and offset
  three_terms = 3,     ///< k, linear and offset
};

/// Weights of the points.
enum class Weighting : std::uint8_t {
  equal,               ///< as given
  thrust,              ///< by their own uncertainty of the thrust
  effective_variance,  ///< 1/(u²(T) + (dT/dω)² u²(ω)): with the errors of the speed (Orear 1982)
};

struct ThrustFitOptions {
  ThrustForm form = ThrustForm::through_origin;
  Weighting weighting = Weighting::equal;
  Loss loss = Loss::none;  ///< scaled by the median absolute deviation
};

struct ThrustFit {
  ThrustParameters<double> parameters;
  /// Standard errors from Ceres' covariance times the residual variance Σ w r²/(n − p). They cover the
  /// scatter from point to point, not errors common to all points (zero, calibration, air density).
  ThrustParameters<double> standard_error;
  /// Of k, linear, offset; 0 for terms that are not free. Of a robust fit: asymptotic (Huber 1981, 7.6).
  std::array<std::array<double, 3>, 3> covariance{};
  double rms_n = 0;      ///< sqrt(Σ w r²/(n − p)), N; w with the robust weight
  double r_squared = 0;  ///< 1 − Σ w r²/Σ w (T − mean T)²
  std::size_t n = 0;
  double speed_min_rad_s = 0;  ///< of the points used
  double speed_max_rad_s = 0;
  std::vector<Point> points;           ///< used, in the order given; weight as it was fitted with
  std::vector<double> robust_weights;  ///< 1: full weight, 0: ignored; one per point used
  std::vector<double> residuals_n;     ///< T − thrust(parameters, ω), one per point used
};

/// Throws FitError when there are fewer points than free terms + 1, when a number is not finite, a
/// weight not positive, an uncertainty missing that `weighting` needs, or the points too alike to fit all terms.
[[nodiscard]] ThrustFit fit_thrust(std::vector<Point> points, const ThrustFitOptions& options = {});

/// k at one speed. On real propellers it differs from the k of a range, since k rises with speed.
struct SpeedCoefficient {
  double k = 0;  ///< mean of T/ω² over the repetitions, N/(rad/s)²
  /// s/√n of the repetitions; quiet NaN from one repetition.
  double standard_error = std::numeric_limits<double>::quiet_NaN();
  double speed_rad_s = 0;  ///< mean measured speed
  std::size_t repetitions = 0;
};

/// `points`: one per repetition, all measured at the same commanded speed. Throws FitError without points or if one
/// has no speed.
[[nodiscard]] SpeedCoefficient k_at_speed(std::span<const Point> points);

}  // namespace kphi::fit
