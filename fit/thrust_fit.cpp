#include "fit/thrust_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "fit/fit_error.hpp"
#include "fit/least_squares.hpp"

namespace kphi::fit {
namespace {

/// ω and T divided by the largest of the points: k of about 1e-6 becomes about 1, so that tolerances mean digits.
struct Scale {
  double speed = 0;
  double thrust = 0;
};

struct ThrustResidual {
  double speed;
  double thrust_value;
  double root_weight;

  template <class Scalar>
  bool operator()(const Scalar* k, const Scalar* linear, const Scalar* offset, Scalar* residual) const {
    residual[0] = root_weight * (thrust_value - thrust(ThrustParameters<Scalar>{*k, *linear, *offset}, speed));
    return true;
  }
};

std::vector<Point> points_in_range(std::span<const Point> points, const ThrustFitOptions& options) {
  std::vector<Point> used;
  for (const Point& point : points) {
    if (!std::isfinite(point.speed_rad_s) || !std::isfinite(point.thrust_n) || !(point.weight > 0) ||
        !std::isfinite(point.weight)) {
      throw FitError(
          fmt::format("thrust fit: a point is no number or its weight is not positive (speed {} rad/s, "
                      "thrust {} N, weight {})",
                      point.speed_rad_s, point.thrust_n, point.weight));
    }
    if (point.speed_rad_s >= options.speed_min_rad_s && point.speed_rad_s <= options.speed_max_rad_s)
      used.push_back(point);
  }
  return used;
}

Scale scale_of(const std::vector<Point>& points) {
  Scale scale;
  for (const Point& point : points) {
    scale.speed = std::max(scale.speed, std::abs(point.speed_rad_s));
    scale.thrust = std::max(scale.thrust, std::abs(point.thrust_n));
  }
  if (scale.speed == 0) throw FitError("thrust fit: every point has speed 0; is the speed column the right one?");
  if (scale.thrust == 0) scale.thrust = 1;
  return scale;
}

std::size_t free_terms(ThrustForm form) {
  switch (form) {
    case ThrustForm::through_origin:
      return 1;
    case ThrustForm::with_offset:
      return 2;
    case ThrustForm::three_terms:
      return 3;
  }
  return 3;
}

void require_distinct_speeds(const std::vector<Point>& points, std::size_t terms) {
  std::set<double> speeds;
  for (const Point& point : points) speeds.insert(point.speed_rad_s);
  if (speeds.size() >= terms) return;
  throw FitError(fmt::format("thrust fit: {} distinct speeds cannot tell {} terms apart; measure at more speeds",
                             speeds.size(), terms));
}

void judge(ThrustFit& fit, std::size_t terms) {
  double sum_w = 0, sum_wt = 0;
  for (const Point& point : fit.points) {
    sum_w += point.weight;
    sum_wt += point.weight * point.thrust_n;
  }
  double residual_sum = 0, total_sum = 0;
  for (const Point& point : fit.points) {
    const double residual = point.thrust_n - thrust(fit.parameters, point.speed_rad_s);
    fit.residuals_n.push_back(residual);
    residual_sum += point.weight * residual * residual;
    total_sum += point.weight * std::pow(point.thrust_n - sum_wt / sum_w, 2);
  }
  fit.rms_n = std::sqrt(residual_sum / static_cast<double>(fit.n - terms));
  fit.r_squared = total_sum > 0 ? 1 - residual_sum / total_sum : 0;
  const auto [low, high] = std::minmax_element(
      fit.points.begin(), fit.points.end(), [](const auto& a, const auto& b) { return a.speed_rad_s < b.speed_rad_s; });
  fit.speed_min_rad_s = low->speed_rad_s;
  fit.speed_max_rad_s = high->speed_rad_s;
}

}  // namespace

ThrustFit fit_thrust(std::span<const Point> points, const ThrustFitOptions& options) {
  ThrustFit fit;
  fit.points = points_in_range(points, options);
  fit.n = fit.points.size();
  const std::size_t terms = free_terms(options.form);
  if (fit.n < terms + 1) {
    throw FitError(
        fmt::format("thrust fit: {} of {} points lie in the speed range, {} terms need at least {}; widen "
                    "the range or measure more steps",
                    fit.n, points.size(), terms, terms + 1));
  }

  require_distinct_speeds(fit.points, terms);
  const Scale scale = scale_of(fit.points);
  double k = 0, linear = 0, offset = 0;
  ceres::Problem problem;
  for (const Point& point : fit.points) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<ThrustResidual, 1, 1, 1, 1>(new ThrustResidual{
            point.speed_rad_s / scale.speed, point.thrust_n / scale.thrust, std::sqrt(point.weight)}),
        nullptr, &k, &linear, &offset);
  }
  std::vector<const double*> free_blocks{&k};
  if (terms >= 2) free_blocks.push_back(&offset);
  if (terms >= 3) free_blocks.push_back(&linear);
  if (terms < 2) problem.SetParameterBlockConstant(&offset);
  if (terms < 3) problem.SetParameterBlockConstant(&linear);
  solve_exactly(problem, "thrust fit");

  const double k_unit = scale.thrust / (scale.speed * scale.speed);
  const double linear_unit = scale.thrust / scale.speed;
  fit.parameters = {k * k_unit, linear * linear_unit, offset * scale.thrust};
  judge(fit, terms);

  const std::vector<double> covariance = unit_covariance(problem, free_blocks, "thrust fit");
  const auto standard_error = [&](std::size_t i, double unit) {
    return i < terms ? std::sqrt(covariance[i * terms + i]) * unit * fit.rms_n / scale.thrust : 0.0;
  };
  fit.standard_error = {standard_error(0, k_unit), standard_error(2, linear_unit), standard_error(1, scale.thrust)};
  return fit;
}

SpeedCoefficient k_at_speed(std::span<const Point> points) {
  if (points.empty()) throw FitError("k at a speed: no step was measured there; name a speed of the profile");
  SpeedCoefficient result;
  result.repetitions = points.size();
  const double n = static_cast<double>(points.size());
  const auto local_k = [](const Point& point) { return point.thrust_n / (point.speed_rad_s * point.speed_rad_s); };
  for (const Point& point : points) {
    if (!(point.speed_rad_s > 0)) throw FitError("k at a speed: a step has no measured speed");
    result.k += local_k(point) / n;
    result.speed_rad_s += point.speed_rad_s / n;
  }
  if (points.size() > 1) {
    double squares = 0;
    for (const Point& point : points) squares += std::pow(local_k(point) - result.k, 2);
    result.standard_error = std::sqrt(squares / (n - 1) / n);
  }
  return result;
}

}  // namespace kphi::fit
