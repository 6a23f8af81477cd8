// The one way in which this folder asks Ceres to solve a small linear problem.
#pragma once

#include <ceres/ceres.h>

#include <utility>
#include <vector>

namespace kphi::fit {

/// For every problem of this folder: they share one context, since each of its own would start a thread of its own.
/// Loss functions stay the caller's.
[[nodiscard]] ceres::Problem::Options problem_options();

/// Solves to rounding (the problems here are linear and scaled to about 1) and says nothing on stdout or stderr.
/// Throws FitError, naming `what`, when Ceres does not converge. One iteration is enough for a start.
void solve_exactly(ceres::Problem& problem, const char* what, int iterations = 4);

/// The same for problems that need iterations, such as those with a robust loss, until nothing moves any more.
/// `tolerance`: of the cost, relative.
void solve_robustly(ceres::Problem& problem, const char* what, double tolerance = 1e-14);

/// Covariance (JᵀJ)⁻¹ between the listed scalar blocks, row by row, losses left aside. Throws FitError, naming `what`,
/// if J is rank deficient.
[[nodiscard]] std::vector<double> unit_covariance(ceres::Problem& problem, const std::vector<const double*>& blocks,
                                                  const char* what);

}  // namespace kphi::fit
