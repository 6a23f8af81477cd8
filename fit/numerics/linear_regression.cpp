#include "fit/numerics/linear_regression.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "base/error.hpp"

namespace kphi::fit {
namespace {

using Long = long double;
using Matrix = Eigen::Matrix<Long, Eigen::Dynamic, Eigen::Dynamic>;
using Vector = Eigen::Matrix<Long, Eigen::Dynamic, 1>;

/// Columns scaled to lengths between 1/2 and 1: powers of x differ by many orders of magnitude. By powers of two, which
/// rounds nothing.
Vector equilibrate(Matrix& design) {
  Vector lengths(design.cols());
  for (Eigen::Index j = 0; j < design.cols(); ++j) {
    const Long norm = design.col(j).norm();
    if (norm == 0) throw FitError("regression: a term is 0 in every row");
    lengths[j] = std::ldexp(Long{1}, std::ilogb(norm) + 1);
    design.col(j) /= lengths[j];
  }
  return lengths;
}

/// a b − product, exactly (Dekker's product by Veltkamp's halves, which is algorithm TwoProduct there). std::fma would
/// do it too, in software and fifty times as slowly.
Long rounded_off(Long a, Long b, Long product) {
  constexpr Long kSplit = (1ULL << (std::numeric_limits<Long>::digits + 1) / 2) + 1;
  const auto upper_half = [](Long x) { return kSplit * x - (kSplit * x - x); };
  const Long a_high = upper_half(a), a_low = a - a_high, b_high = upper_half(b), b_low = b - b_high;
  return ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

/// Σ a b as if summed in twice the digits (Ogita, Rump, Oishi, "Accurate sum and dot product", 2005, algorithm Dot2).
Long accurate_dot(const Vector& a, const Vector& b) {
  Long sum = 0, errors = 0;
  for (Eigen::Index i = 0; i < a.size(); ++i) {
    const Long product = a[i] * b[i];
    const Long next = sum + product;
    const Long taken = next - sum;
    errors += rounded_off(a[i], b[i], product) + ((sum - (next - taken)) + (product - taken));
    sum = next;
  }
  return sum + errors;
}

/// Where residuals are large, least squares lose twice as many digits as an equation would. Xᵀr shows how far the
/// solution is from the minimum.
template <class Upper>
void refine(const Matrix& design, const Upper& upper, const Vector& y, Vector& beta) {
  for (int step = 0; step < 2; ++step) {
    const Vector residual = y - design * beta;
    Vector gradient(design.cols());
    for (Eigen::Index j = 0; j < design.cols(); ++j) gradient[j] = accurate_dot(design.col(j), residual);
    const Vector change = upper.solve(upper.transpose().solve(gradient));
    beta += change;
    if (change.norm() < 1e-17L * beta.norm()) break;
  }
}

Vector vector_of(std::span<const double> values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).cast<Long>();
}

std::vector<double> rounded(const Vector& values) {
  std::vector<double> result(static_cast<std::size_t>(values.size()));
  Eigen::Map<Eigen::VectorXd>(result.data(), values.size()) = values.cast<double>();
  return result;
}

Regression solve(Matrix design, const Vector& values, std::span<const double> weights) {
  if (design.rows() < design.cols()) throw FitError("regression: fewer rows than terms; measure more");
  const Matrix plain = design;
  const Vector root_weights =
      weights.empty() ? Vector(Vector::Ones(values.size())) : Vector(vector_of(weights).cwiseSqrt());
  for (Eigen::Index i = 0; i < design.rows(); ++i) design.row(i) *= root_weights[i];
  const Vector y = values.cwiseProduct(root_weights);
  const Vector lengths = equilibrate(design);
  const Eigen::HouseholderQR<Matrix> qr(design);
  const Matrix factor = qr.matrixQR().topRows(design.cols());
  const auto upper = factor.template triangularView<Eigen::Upper>();
  constexpr Long kSingular = 1e-17L;
  if ((factor.diagonal().array().abs() < kSingular).any())
    throw FitError("regression: too few different rows to fit all terms; measure more");
  Vector beta = qr.solve(y);
  refine(design, upper, y, beta);
  beta = beta.cwiseQuotient(lengths);
  const Matrix inverse =
      lengths.asDiagonal().inverse() * Matrix(upper.solve(Matrix::Identity(design.cols(), design.cols())));
  const Matrix covariance = inverse * inverse.transpose();

  Regression result;
  result.estimates = rounded(beta);
  const Vector residuals = values - plain * beta;
  result.residuals = rounded(residuals);
  const Long squares = residuals.cwiseProduct(root_weights).squaredNorm();
  result.weighted_squares = static_cast<double>(squares);
  result.freedom = static_cast<std::size_t>(design.rows() - design.cols());
  const Long variance = result.freedom > 0 ? squares / static_cast<Long>(result.freedom) : 0;
  result.residual_deviation = static_cast<double>(std::sqrt(variance));
  result.standard_errors = rounded((variance * covariance.diagonal()).cwiseSqrt());
  for (const auto column : covariance.colwise()) result.covariance.push_back(rounded(column));
  return result;
}

}  // namespace

Regression regress(const std::vector<std::vector<double>>& rows, std::span<const double> y,
                   std::span<const double> weights) {
  if (rows.empty()) throw FitError("regression: no rows");
  const auto n = static_cast<Eigen::Index>(rows.size());
  Matrix design(n, static_cast<Eigen::Index>(rows.front().size()));
  for (Eigen::Index i = 0; i < n; ++i) design.row(i) = vector_of(rows[static_cast<std::size_t>(i)]).transpose();
  return solve(std::move(design), vector_of(y), weights);
}

Regression regress_polynomial(std::span<const double> x, std::span<const double> y, int lowest, int highest,
                              std::span<const double> weights) {
  const auto n = static_cast<Eigen::Index>(x.size());
  Matrix design(n, highest - lowest + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (int power = lowest; power <= highest; ++power)
      design(i, power - lowest) = std::pow(static_cast<Long>(x[static_cast<std::size_t>(i)]), power);
  }
  return solve(std::move(design), vector_of(y), weights);
}

}  // namespace kphi::fit
