// Statistics of evenly spaced values, such as means of equal bins: how certain their mean is, from where on they are
// settled, whether they drift. Pure functions.
//
// Mean of correlated values: the Γ-method (U. Wolff, Monte Carlo errors with less errors, Comput. Phys. Commun. 156
// (2004) 143, equations 31, 49 and 52, S = 1.5). Values that alternate, as a periodic noise makes them, would end its
// sum too early and far too low; for these, the slow cosines (science.md, eq. 4 to 6) (E. Lazarus et al., HAR
// inference: recommendations for practice, J. Bus. Econ. Stat. 36 (2018) 541: equal-weighted cosines, Student's t).
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace kphi::results {

struct MeanError {
  double mean = std::numeric_limits<double>::quiet_NaN();
  double u = std::numeric_limits<double>::quiet_NaN();  ///< standard uncertainty of the mean
  double correlation = 1;                               ///< n / n_eff, of the values as given
  double freedom = 0;                                   ///< degrees of freedom of u: for Student's t
};

/// `values`: evenly spaced, without a trend; u is NaN for fewer than kLeastValues. `fitted`: number of parameters that
/// were fitted and subtracted, including the mean.
[[nodiscard]] MeanError mean_error(std::span<const double> values, int fitted = 1);
inline constexpr std::size_t kLeastValues = 6;

/// The values minus their least-squares line: a linear trend does not change a mean taken at the middle.
[[nodiscard]] std::vector<double> without_trend(std::span<const double> values);

/// Two-sided quantile of Student's t: `confidence` of the distribution lies within ± this.
[[nodiscard]] double student(double freedom, double confidence);
[[nodiscard]] inline double student_95(double freedom) { return student(freedom, 0.95); }

/// Degrees of freedom of the root sum of squares of two uncertainties (Welch-Satterthwaite).
[[nodiscard]] double joint_freedom(double u1, double freedom1, double u2, double freedom2);

/// Shortest averaging window, at the end of a step, s; half of what the discard leaves if that is less.
inline constexpr double kLeastWindow = 0.5;
/// The thrust is steady if it changes over the window by less than this share, or by less than the 95 % interval of the
/// slope.
inline constexpr double kSteadyShare = 0.001;
/// Confidence of the slope above which a step is unsettled. The search for a window uses 95 %; of the settled steps one
/// in 200 finds no window.
inline constexpr double kUnsettledConfidence = 0.9995;
/// The thrust at constant speed drifts if it changes by more than this share in the second half of a step.
inline constexpr double kDriftShare = 0.005;

struct Settling {
  std::size_t begin = 0;  ///< first bin of the window, which goes to the end of the step
  bool settled = false;
};

/// The earliest window from bin `first` on (NaN: empty bin) that is steady. The uncertainty of the slope comes from the
/// last two shortest windows, where the transient is smallest. Without a steady window the last shortest one, unsettled
/// by kUnsettledConfidence. `planned`: bins after the minimum discard.
[[nodiscard]] Settling settle(std::span<const double> thrust, std::size_t first, std::size_t planned, double bin_s);

/// True if the thrust rises, or falls, through both halves by a rank test (Kendall), which needs no model of the noise,
/// and in the second half by more than kDriftShare: a dying transient does not.
[[nodiscard]] bool drifts(std::span<const double> thrust);

}  // namespace kphi::results
