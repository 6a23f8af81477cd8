// How certain the mean of correlated values is: the Γ-method (U. Wolff, Monte Carlo errors with less errors,
// Comput. Phys. Commun. 156 (2004) 143, equations 31, 49 and 52, S = 1.5).
#pragma once

#include <limits>
#include <span>
#include <vector>

namespace kphi::daq {

struct MeanError {
  double mean = std::numeric_limits<double>::quiet_NaN();
  double u = std::numeric_limits<double>::quiet_NaN();  ///< standard uncertainty of the mean
  double correlation = 1;                               ///< n / n_eff, of the values as given
  double freedom = 0;                                   ///< degrees of freedom of u: for Student's t
  [[nodiscard]] double half_width_95() const;           ///< of the 95 % interval about the mean
};

/// Of evenly spaced values without a trend. With fewer than kLeastValues of them u is NaN.
[[nodiscard]] MeanError mean_error(std::span<const double> values);
inline constexpr std::size_t kLeastValues = 6;

/// The values less the least-squares line through them: of a mean at the middle the trend is no uncertainty.
[[nodiscard]] std::vector<double> without_trend(std::span<const double> values);

/// Two-sided 95 % point of Student's t.
[[nodiscard]] double student_95(double freedom);

/// Degrees of freedom of the root sum of squares of two uncertainties (Welch-Satterthwaite).
[[nodiscard]] double joint_freedom(double u1, double freedom1, double u2, double freedom2);

}  // namespace kphi::daq
