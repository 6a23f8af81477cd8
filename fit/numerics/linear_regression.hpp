// Linear least squares in closed form, to the last digits: QR of the equilibrated design matrix in extended precision
// with refinement. Tested on the certified NIST problems.
#pragma once

#include <span>
#include <vector>

namespace kphi::fit {

struct Regression {
  std::vector<double> estimates;
  std::vector<double> standard_errors;          ///< sqrt of the diagonal of residual variance · (XᵀWX)⁻¹
  std::vector<std::vector<double>> covariance;  ///< (XᵀWX)⁻¹ without the residual variance
  double residual_deviation = 0;                ///< sqrt(Σ w r²/(n − p)); 0 when n = p
  double weighted_squares = 0;                  ///< Σ w r²
  std::size_t freedom = 0;                      ///< n − p
  std::vector<double> residuals;
};

/// y ≈ X β. `rows` of the design, all as long as the first; `weights` of the squared residuals, empty: 1 each. Throws
/// FitError for fewer rows than terms, or rows too alike to fit all terms.
[[nodiscard]] Regression regress(const std::vector<std::vector<double>>& rows, std::span<const double> y,
                                 std::span<const double> weights = {});

/// y ≈ Σ β_j x^j, j from `lowest` to `highest`. Powers are formed in extended precision.
[[nodiscard]] Regression regress_polynomial(std::span<const double> x, std::span<const double> y, int lowest,
                                            int highest, std::span<const double> weights = {});

}  // namespace kphi::fit
