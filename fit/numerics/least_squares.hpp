// Small linear problems, solved by Ceres.
#pragma once

#include <ceres/ceres.h>

#include <memory>
#include <vector>

#include "fit/numerics/loss.hpp"

namespace kphi::fit {

/// Options with one shared context: a context per problem would start a thread each. The caller owns the loss
/// functions.
[[nodiscard]] ceres::Problem::Options problem_options();

/// `sigma` of the points, in units of the residuals. nullptr without a loss or for 0: points without scatter have no
/// outliers.
[[nodiscard]] std::unique_ptr<ceres::LossFunction> loss_function(Loss loss, double sigma);

/// Solves to rounding (the problems here are linear and scaled to about 1) and prints nothing. Throws FitError, naming
/// `what`, when Ceres does not converge. One iteration is enough for a start.
void solve_exactly(ceres::Problem& problem, const char* what, int iterations = 4);

/// The same for problems that need iterations, such as those with a robust loss. `tolerance`: of the cost, relative.
void solve_robustly(ceres::Problem& problem, const char* what, double tolerance = 1e-14);

/// Covariance (JᵀJ)⁻¹ between the listed scalar blocks, row by row, without the losses. Throws FitError, naming `what`,
/// if J is rank deficient.
[[nodiscard]] std::vector<double> unit_covariance(ceres::Problem& problem, const std::vector<const double*>& blocks,
                                                  const char* what);

}  // namespace kphi::fit
