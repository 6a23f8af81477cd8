// How well k repeats: noise within the runs, the zero, and the scatter from run to run beyond the two
// (mounting, air, bearing), pooled over all occlusions as a share of k, since three repetitions alone are too few.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "fit/model/thrust_fit.hpp"
#include "fit/numerics/hypothesis_test.hpp"
#include "results/reduction/repetitions.hpp"
#include "results/reduction/run_zero.hpp"
#include "results/step_mean.hpp"

namespace kphi::fit {

/// From mounting to mounting, share of k, standard: assumed where nobody measured it.
inline constexpr double kAssumedMounting = 0.005;
inline constexpr const char* kWhyMounting = "two mountings of one set-up differ by 1 % in careful laboratories";
inline constexpr const char* kRemount = "mount each repetition anew (remount_each_repetition)";

struct RunSums {
  double phi_deg = 0;
  int repetition = 0;
  double xt = 0;               ///< Σ w x T; x = ω², or the map's term in its place
  double xx = 0;               ///< Σ w x²
  double x = 0;                ///< Σ w x
  double zero_u_n = 0;         ///< standard, of the zero that its steps share; 0: unknown
  double w = 0;                ///< Σ w
  double t = 0;                ///< Σ w T
  double offset_zero_u_n = 0;  ///< as zero_u_n, of offset()

  [[nodiscard]] double k() const { return xt / xx; }  ///< N/(rad/s)²
  [[nodiscard]] bool has_offset() const { return determinant() > 1e-6 * w * xx; }
  [[nodiscard]] double offset() const { return (xx * t - x * xt) / determinant(); }  ///< of the line of T on x, N
  [[nodiscard]] double slope() const { return (w * xt - x * t) / determinant(); }    ///< of that
  /// Change of offset() for 1 N of a step.
  [[nodiscard]] double in_offset(double w1, double x1) const { return w1 * (xx - x * x1) / determinant(); }
  [[nodiscard]] double determinant() const { return w * xx - x * x; }
};

/// Scatter of the steps of one φ within their runs.
struct WithinRuns {
  double variance = 0;  ///< of the k of one run, (N/(rad/s)²)²
  double freedom = 0;
  double offset_variance = 0;  ///< of the offset of one run, N²; 0: not known
};

/// One per repetition, ascending. `fit` was made of `steps`, one point each in the same order; x is its map divided by
/// `k`; `movement` of the zeros of the campaign.
[[nodiscard]] std::vector<RunSums> sums_of_runs(double phi_deg, std::span<const results::StepMean> steps,
                                                const ThrustFit& fit, double k, const results::ZeroMovement& movement);

/// science.md, eq. 13. From the interaction of step and repetition, which contains neither errors of whole runs, in
/// proportion or in newtons, nor of the map; from the residuals of a single run.
[[nodiscard]] WithinRuns scatter_within_runs(std::span<const results::StepMean> steps, const ThrustFit& fit, double k,
                                             std::span<const RunSums> runs);

/// Of one φ; standard uncertainties of the mean over its runs.
struct AngleScatter {
  double k = 0;
  std::vector<RunSums> runs;
  WithinRuns within;            ///< of one run
  double zero_u_n = 0;          ///< of the mean of the runs' zeros
  double zero_sensitivity = 0;  ///< of k per N

  [[nodiscard]] double within_u() const;  ///< N/(rad/s)²
  [[nodiscard]] double zero_u() const { return zero_u_n * zero_sensitivity; }
};

struct Repeatability {
  std::vector<AngleScatter> angles;
  Estimate between;           ///< u: standard deviation from run to run as a share of k, beyond noise and zero; value 0
  Estimate zero_beyond{};     ///< and of an error that adds to the thrust, beyond what is told of the zero, N
  bool repeated = false;      ///< at least one φ was measured more than once
  bool mounted_once = false;  ///< for all repetitions of a φ: `between` does not hold the mounting
  std::optional<double> mounting{};  ///< then: standard deviation of k from mounting to mounting, as a share
  bool mounting_assumed = false;     ///< nobody gave it
  Estimate zero_movement{};          ///< of a run's zero, usually, N; freedom: the runs behind it

  /// Of k at angle i, from all errors that are independent from φ to φ, N/(rad/s)²; science.md, eq. 17.
  [[nodiscard]] double independent_u(std::size_t i) const;
  /// Degrees of freedom of the zero, which all φ share; 0: endless.
  [[nodiscard]] double freedom_of_zero() const;
  /// Degrees of freedom of those uncertainties, which share `between`.
  [[nodiscard]] double freedom() const;
};

[[nodiscard]] Repeatability repeatability(std::vector<AngleScatter> angles, const Estimate& zero_movement = {});

/// A run further from the others of its φ than chance explains. It stays in k and in the scatter of the repetitions.
struct OutlyingRun {
  double phi_deg = 0;
  int repetition = 0;
  double share = 0;  ///< its k / k of the others − 1
  double p = 1;      ///< that chance alone puts one of all runs this far off; NaN: too few runs, Hampel's identifier
};

/// The judge of the campaign, results::judge_repetitions(), on the steps of the fit.
[[nodiscard]] std::vector<OutlyingRun> outlying_runs(std::span<const results::StepMean> used);

[[nodiscard]] AngleScatter scatter_of_angle(double k, std::vector<RunSums> runs, const WithinRuns& within);

}  // namespace kphi::fit
