// How certain the mean of correlated values is: the Γ-method (U. Wolff, Monte Carlo errors with less errors,
// Comput. Phys. Commun. 156 (2004) 143, equations 31, 49 and 52, S = 1.5). Values that alternate, such as those that a
// periodic noise leaves, would end its sum too early and far too low: of these the slow cosines tell (E. Lazarus et
// al., HAR inference: recommendations for practice, J. Bus. Econ. Stat. 36 (2018) 541: equal-weighted cosines,
// Student's t).
#pragma once

#include <limits>
#include <span>
#include <vector>

namespace kphi::results {

struct MeanError {
  double mean = std::numeric_limits<double>::quiet_NaN();
  double u = std::numeric_limits<double>::quiet_NaN();  ///< standard uncertainty of the mean
  double correlation = 1;                               ///< n / n_eff, of the values as given
  double freedom = 0;                                   ///< degrees of freedom of u: for Student's t
  [[nodiscard]] double half_width_95() const;           ///< of the 95 % interval about the mean
};

/// Of evenly spaced values without a trend. With fewer than kLeastValues of them u is NaN. `fitted`: parameters that
/// were fitted to them and subtracted, the mean among them.
[[nodiscard]] MeanError mean_error(std::span<const double> values, int fitted = 1);
inline constexpr std::size_t kLeastValues = 6;

/// The values less the least-squares line through them: of a mean at the middle the trend is no uncertainty.
[[nodiscard]] std::vector<double> without_trend(std::span<const double> values);

/// Two-sided point of Student's t: `confidence` of it lies within plus and minus this.
[[nodiscard]] double student(double freedom, double confidence);
[[nodiscard]] inline double student_95(double freedom) { return student(freedom, 0.95); }

/// Degrees of freedom of the root sum of squares of two uncertainties (Welch-Satterthwaite).
[[nodiscard]] double joint_freedom(double u1, double freedom1, double u2, double freedom2);

}  // namespace kphi::results
