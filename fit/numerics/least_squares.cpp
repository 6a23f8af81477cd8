#include "fit/numerics/least_squares.hpp"

#include <fmt/format.h>

#include <array>
#include <memory>

#include "base/error.hpp"

namespace kphi::fit {
namespace {

void solve(ceres::Problem& problem, const char* what, ceres::Solver::Options& options) {
  options.linear_solver_type = ceres::DENSE_QR;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) throw FitError(fmt::format("{}: no solution ({})", what, summary.message));
}

}  // namespace

ceres::Problem::Options problem_options() {
  static const std::unique_ptr<ceres::Context> context(ceres::Context::Create());
  ceres::Problem::Options options;
  options.context = context.get();
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  return options;
}

std::unique_ptr<ceres::LossFunction> loss_function(Loss loss, double sigma) {
  if (!(sigma > 0)) return nullptr;
  if (loss == Loss::huber) return std::make_unique<ceres::HuberLoss>(1.345 * sigma);
  if (loss == Loss::cauchy) return std::make_unique<ceres::CauchyLoss>(2.385 * sigma);
  if (loss == Loss::tukey) return std::make_unique<ceres::TukeyLoss>(4.685 * sigma);
  return nullptr;
}

const char* name_of(Loss loss) {
  constexpr std::array<const char*, 4> names{"none", "huber", "cauchy", "tukey"};
  return names[static_cast<std::size_t>(loss)];
}

double robust_weight(Loss loss, double deviation) {
  const auto function = loss_function(loss, 1);
  if (!function) return 1;
  std::array<double, 3> rho{};
  function->Evaluate(deviation * deviation, rho.data());
  return rho[1];
}

void solve_exactly(ceres::Problem& problem, const char* what, int iterations) {
  ceres::Solver::Options options;
  // The problem is linear: an almost undamped first step lands on the minimum, the next ones polish the last digits.
  // There the cost no longer falls, which Ceres would count as failure, so the number of steps is fixed.
  options.initial_trust_region_radius = 1e16;
  options.max_trust_region_radius = 1e32;
  options.max_num_iterations = iterations;
  options.max_num_consecutive_invalid_steps = options.max_num_iterations + 1;
  options.function_tolerance = 0;
  options.gradient_tolerance = 0;
  options.parameter_tolerance = 0;
  solve(problem, what, options);
}

void solve_robustly(ceres::Problem& problem, const char* what, double tolerance) {
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.function_tolerance = tolerance;
  options.gradient_tolerance = 1e-14;
  options.parameter_tolerance = 1e-11;
  solve(problem, what, options);
}

std::vector<double> unit_covariance(ceres::Problem& problem, const std::vector<const double*>& blocks,
                                    const char* what) {
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  options.apply_loss_function = false;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  std::vector<double> matrix(blocks.size() * blocks.size());
  if (!covariance.Compute(blocks, &problem) || !covariance.GetCovarianceMatrix(blocks, matrix.data())) {
    throw FitError(fmt::format("{}: too few different speeds or angles to fit all terms; measure at more", what));
  }
  return matrix;
}

}  // namespace kphi::fit
