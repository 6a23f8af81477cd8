#include "fit/model/thrust_fit.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

#include "base/error.hpp"
#include "base/statistics.hpp"
#include "fit/numerics/least_squares.hpp"

namespace kphi::fit {
namespace {

/// ω and T divided by the largest of the points: k of about 1e-6 becomes about 1, so that tolerances mean digits.
struct Scale {
  double speed = 0;
  double thrust = 0;
};

/// One equation: coefficients of k, linear and offset, and their sum.
struct Equation {
  std::array<double, 3> terms{};
  double sum = 0;

  template <class Scalar>
  bool operator()(const Scalar* k, const Scalar* linear, const Scalar* offset, Scalar* residual) const {
    residual[0] = sum - terms[0] * *k - terms[1] * *linear - terms[2] * *offset;
    return true;
  }
};

void require_numbers(std::span<const Point> points) {
  for (const Point& point : points) {
    if (!std::isfinite(point.speed_rad_s) || !std::isfinite(point.thrust_n) || !(point.weight > 0) ||
        !std::isfinite(point.weight)) {
      throw FitError(
          fmt::format("thrust fit: a point is not a number or its weight is not positive (speed {} rad/s, "
                      "thrust {} N, weight {})",
                      point.speed_rad_s, point.thrust_n, point.weight));
    }
  }
}

Scale scale_of(const std::vector<Point>& points) {
  Scale scale;
  for (const Point& point : points) {
    scale.speed = std::max(scale.speed, std::abs(point.speed_rad_s));
    scale.thrust = std::max(scale.thrust, std::abs(point.thrust_n));
  }
  if (scale.speed == 0) throw FitError("thrust fit: every point has speed 0; check the speed column");
  if (scale.thrust == 0) scale.thrust = 1;
  return scale;
}

void require_distinct_speeds(const std::vector<Point>& points, std::size_t terms) {
  std::set<double> speeds;
  for (const Point& point : points) {
    speeds.insert(point.speed_rad_s);
    if (speeds.size() >= terms) return;
  }
  throw FitError(fmt::format("thrust fit: {} different speeds are too few for {} terms; measure at more speeds",
                             speeds.size(), terms));
}

/// Weights 1/u², scaled to a mean of 1, so that the rms stays in N of thrust. `parameters`: for dT/dω; none: by T ~ ω².
void weigh(std::vector<Point>& points, Weighting weighting, const ThrustParameters<double>* parameters) {
  double sum = 0;
  for (Point& point : points) {
    double slope = 2 * point.thrust_n / point.speed_rad_s;
    if (parameters != nullptr) slope = 2 * parameters->k * point.speed_rad_s + parameters->linear;
    const double u_speed = weighting == Weighting::effective_variance ? slope * point.u_speed_rad_s : 0.0;
    const double variance = point.u_thrust_n * point.u_thrust_n + u_speed * u_speed;
    if (!(variance > 0) || !std::isfinite(variance))
      throw FitError("thrust fit: a step without an uncertainty cannot be weighted by it; fit with equal weights");
    point.weight = 1 / variance;
    sum += point.weight;
  }
  for (Point& point : points) point.weight *= static_cast<double>(points.size()) / sum;
}

/// Thrust and speed scaled to at most 1; every solution starts from the last one.
class Fitter {
 public:
  Fitter(const Scale& scale, std::size_t terms) : scale_(scale), terms_(terms) {}

  /// With their present weights.
  void take(const std::vector<Point>& points) {
    squares_ = problem_of(triangle_of(points));
    robust_.reset();
  }

  /// Solves for the points taken last. A `coarse` solution only gives the start and the scale of the next one.
  void solve(const std::vector<Point>& points, Loss loss, bool coarse = false) {
    loss_ = loss == Loss::none ? nullptr : loss_function(loss, deviation_of(points));
    if (!loss_) return solve_exactly(*squares_, "thrust fit", coarse ? 1 : 4);
    changing_loss_.Reset(loss_.get(), ceres::DO_NOT_TAKE_OWNERSHIP);
    if (!robust_) {
      std::vector<Equation> equations;
      equations.reserve(points.size());
      for (const Point& point : points) equations.push_back(equation_of(point));
      robust_ = problem_of(equations);
    }
    solve_robustly(*robust_, "thrust fit", coarse ? 1e-4 : 1e-14);
    residuals_.clear();
    for (const Point& point : points) residuals_.push_back(residual(point));
  }

  [[nodiscard]] ThrustParameters<double> parameters() const {
    return {k_ * unit(0), linear_ * unit(1), offset_ * unit(2)};
  }

  [[nodiscard]] std::vector<double> robust_weights(std::size_t points) const {
    std::vector<double> weights(points, 1.0);
    if (loss_) std::ranges::transform(residuals_, weights.begin(), [this](double r) { return rho(r)[1]; });
    return weights;
  }

  /// Of k, linear, offset. `rms_n` of the fit without a loss; with one the spread of its influence takes its place.
  [[nodiscard]] std::array<std::array<double, 3>, 3> covariance(double rms_n) const {
    std::vector<const double*> blocks{&k_};
    std::vector<std::size_t> places{0};
    if (terms_ >= 3) (blocks.push_back(&linear_), places.push_back(1));
    if (terms_ >= 2) (blocks.push_back(&offset_), places.push_back(2));
    const std::vector<double> unit_matrix = unit_covariance(*squares_, blocks, "thrust fit");
    const double variance = loss_ ? robust_variance() : std::pow(rms_n / scale_.thrust, 2);
    std::array<std::array<double, 3>, 3> result{};
    for (std::size_t i = 0; i < terms_; ++i) {
      for (std::size_t j = 0; j < terms_; ++j)
        result[places[i]][places[j]] = unit_matrix[i * terms_ + j] * variance * unit(places[i]) * unit(places[j]);
    }
    return result;
  }

 private:
  [[nodiscard]] double unit(std::size_t term) const {
    return scale_.thrust / std::pow(scale_.speed, 2 - static_cast<double>(term));
  }

  [[nodiscard]] Equation equation_of(const Point& point) const {
    const double root = std::sqrt(point.weight), speed = point.speed_rad_s / scale_.speed;
    return {{root * speed * speed, terms_ < 3 ? 0 : root * speed, terms_ < 2 ? 0 : root},
            root * point.thrust_n / scale_.thrust};
  }

  /// Four equations whose least squares are those of all points: R of a QR decomposition, block by block.
  [[nodiscard]] std::vector<Equation> triangle_of(const std::vector<Point>& points) const {
    constexpr Eigen::Index kBlock = 256, kColumns = 4;
    Eigen::Matrix<double, kBlock, kColumns> rows;
    Eigen::Index filled = kColumns;
    rows.topRows<kColumns>().setZero();
    const auto reduce = [&] {
      const Eigen::MatrixXd block = rows.topRows(filled);
      rows.topRows<kColumns>() = block.householderQr().matrixQR().topRows<kColumns>().triangularView<Eigen::Upper>();
      filled = kColumns;
    };
    for (const Point& point : points) {
      const auto [terms, sum] = equation_of(point);
      rows.row(filled) << terms[0], terms[1], terms[2], sum;
      if (++filled == kBlock) reduce();
    }
    reduce();
    std::vector<Equation> triangle;
    for (Eigen::Index i = 0; i < kColumns; ++i) triangle.push_back({{rows(i, 0), rows(i, 1), rows(i, 2)}, rows(i, 3)});
    return triangle;
  }

  [[nodiscard]] std::unique_ptr<ceres::Problem> problem_of(const std::vector<Equation>& equations) {
    auto problem = std::make_unique<ceres::Problem>(problem_options());
    for (const Equation& equation : equations) {
      problem->AddResidualBlock(new ceres::AutoDiffCostFunction<Equation, 1, 1, 1, 1>(new Equation(equation)),
                                &changing_loss_, &k_, &linear_, &offset_);
    }
    if (terms_ < 2) problem->SetParameterBlockConstant(&offset_);
    if (terms_ < 3) problem->SetParameterBlockConstant(&linear_);
    return problem;
  }

  [[nodiscard]] double residual(const Point& point) const {
    const ThrustParameters<double> scaled{k_, linear_, offset_};
    return std::sqrt(point.weight) *
           (point.thrust_n / scale_.thrust - thrust(scaled, point.speed_rad_s / scale_.speed));
  }

  /// Of the residuals, by their median.
  [[nodiscard]] double deviation_of(const std::vector<Point>& points) const {
    std::vector<double> deviations;
    for (const Point& point : points) deviations.push_back(std::abs(residual(point)));
    return 1.4826 * upper_median(std::move(deviations));
  }

  /// ρ, ρ', ρ'' of the squared residual.
  [[nodiscard]] std::array<double, 3> rho(double r) const {
    std::array<double, 3> value{r * r, 1, 0};
    if (loss_) loss_->Evaluate(r * r, value.data());
    return value;
  }

  /// Σψ²/(n − p) over the square of the mean ψ', ψ = r ρ'.
  [[nodiscard]] double robust_variance() const {
    double squares = 0, slope = 0;
    for (const double r : residuals_) {
      const auto [value, first, second] = rho(r);
      squares += std::pow(r * first, 2);
      slope += first + 2 * r * r * second;
    }
    const double n = static_cast<double>(residuals_.size());
    return squares / (n - static_cast<double>(terms_)) / std::pow(slope / n, 2);
  }

  Scale scale_;
  std::size_t terms_;
  double k_ = 0, linear_ = 0, offset_ = 0;
  std::unique_ptr<ceres::LossFunction> loss_;
  ceres::LossFunctionWrapper changing_loss_{nullptr, ceres::DO_NOT_TAKE_OWNERSHIP};
  std::unique_ptr<ceres::Problem> squares_;  ///< four equations that stand for all points
  std::unique_ptr<ceres::Problem> robust_;   ///< one equation a point, where a loss judges each
  std::vector<double> residuals_;            ///< under a loss
};

void judge(ThrustFit& fit, std::size_t terms) {
  double sum_w = 0, sum_wt = 0;
  for (std::size_t i = 0; i < fit.n; ++i) {
    const double weight = fit.points[i].weight * fit.robust_weights[i];
    sum_w += weight;
    sum_wt += weight * fit.points[i].thrust_n;
  }
  double residual_sum = 0, total_sum = 0;
  fit.residuals_n.reserve(fit.n);
  for (std::size_t i = 0; i < fit.n; ++i) {
    const Point& point = fit.points[i];
    const double residual = point.thrust_n - thrust(fit.parameters, point.speed_rad_s);
    fit.residuals_n.push_back(residual);
    residual_sum += point.weight * fit.robust_weights[i] * residual * residual;
    total_sum += point.weight * fit.robust_weights[i] * std::pow(point.thrust_n - sum_wt / sum_w, 2);
  }
  fit.rms_n = std::sqrt(residual_sum / static_cast<double>(fit.n - terms));
  fit.r_squared = total_sum > 0 ? 1 - residual_sum / total_sum : 0;
  const auto [low, high] = std::ranges::minmax_element(fit.points, {}, &Point::speed_rad_s);
  fit.speed_min_rad_s = low->speed_rad_s;
  fit.speed_max_rad_s = high->speed_rad_s;
}

}  // namespace

ThrustFit fit_thrust(std::vector<Point> points, const ThrustFitOptions& options) {
  ThrustFit fit;
  require_numbers(points);
  fit.points = std::move(points);
  fit.n = fit.points.size();
  const auto terms = static_cast<std::size_t>(options.form);
  if (fit.n < terms + 1) {
    throw FitError(
        fmt::format("thrust fit: {} points, but {} terms need at least {}; widen the range of speeds or "
                    "measure more steps",
                    fit.n, terms, terms + 1));
  }
  require_distinct_speeds(fit.points, terms);
  if (options.weighting != Weighting::equal) weigh(fit.points, options.weighting, nullptr);
  Fitter fitter(scale_of(fit.points), terms);
  const auto solve = [&](Loss loss, bool coarse = false) {
    fitter.solve(fit.points, loss, coarse);
    fit.parameters = fitter.parameters();
  };
  fitter.take(fit.points);
  solve(Loss::none, options.loss != Loss::none);
  if (options.loss != Loss::none) solve(Loss::huber, true);  // a convex problem leads the others to the right minimum
  constexpr int kReweightings = 3;
  for (int i = 0; i < kReweightings && options.weighting == Weighting::effective_variance; ++i) {
    weigh(fit.points, options.weighting, &fit.parameters);
    fitter.take(fit.points);
    solve(options.loss == Loss::none ? Loss::none : Loss::huber);
  }
  if (options.loss != Loss::none) solve(options.loss);
  fit.robust_weights = fitter.robust_weights(fit.n);
  judge(fit, terms);
  fit.covariance = fitter.covariance(fit.rms_n);
  const auto error = [&](std::size_t i) { return std::sqrt(fit.covariance[i][i]); };
  fit.standard_error = {error(0), error(1), error(2)};
  return fit;
}

SpeedCoefficient k_at_speed(std::span<const Point> points) {
  if (points.empty()) throw FitError("k at a speed: no step at that speed; name a speed of the profile");
  SpeedCoefficient result;
  result.repetitions = points.size();
  const double n = static_cast<double>(points.size());
  std::vector<double> k;
  for (const Point& point : points) {
    if (!(point.speed_rad_s > 0)) throw FitError("k at a speed: a step has no measured speed");
    k.push_back(point.thrust_n / (point.speed_rad_s * point.speed_rad_s));
    result.speed_rad_s += point.speed_rad_s / n;
  }
  result.k = mean(k);
  result.standard_error = std::sqrt(variance(k) / n);
  return result;
}

}  // namespace kphi::fit
