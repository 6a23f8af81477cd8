#include "fit/speed_dependence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "fit/fit_error.hpp"
#include "fit/linear_regression.hpp"

namespace kphi::fit {
namespace {

/// The steps of one level: T about k_run ω², run by run.
struct Level {
  std::vector<double> residuals, local_k;
  double speed = 0, x = 0;
  [[nodiscard]] double n() const { return static_cast<double>(residuals.size()); }
  [[nodiscard]] double mean(const std::vector<double>& values) const {
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / n();
  }
  [[nodiscard]] double variance(const std::vector<double>& values) const {
    double squares = 0;
    for (const double value : values) squares += std::pow(value - mean(values), 2);
    return squares / (n() - 1);
  }
};

std::map<int, double> k_of_runs(std::span<const results::StepMean> steps) {
  std::map<int, std::pair<double, double>> sums;
  for (const results::StepMean& step : steps) {
    const double x = step.speed_rad_s * step.speed_rad_s;
    sums[step.repetition].first += x * step.thrust_n;
    sums[step.repetition].second += x * x;
  }
  std::map<int, double> k;
  for (const auto& [repetition, sum] : sums) k[repetition] = sum.first / sum.second;
  return k;
}

std::map<int, Level> levels_of(std::span<const results::StepMean> steps, const std::map<int, double>& k) {
  std::map<int, Level> levels;
  for (const results::StepMean& step : steps) {
    const double x = step.speed_rad_s * step.speed_rad_s;
    if (!(x > 0)) continue;
    Level& level = levels[step.step];
    level.residuals.push_back(step.thrust_n - k.at(step.repetition) * x);
    level.local_k.push_back(step.thrust_n / x);
    level.speed += step.speed_rad_s;
    level.x += x;
  }
  for (auto& [index, level] : levels) {
    level.speed /= level.n();
    level.x /= level.n();
  }
  return levels;
}

/// Variance of one residual as a + b x², neither negative: the cell's noise and the air's.
struct NoiseModel {
  double constant = 0, growing = 0;
  [[nodiscard]] double at(double x) const { return constant + growing * x * x; }
};

/// `scale` makes x about 1.
NoiseModel noise_of(const std::vector<Level>& levels, double scale) {
  std::vector<double> squares, variances;
  double mean = 0, share = 0, square_sum = 0;
  for (const Level& level : levels) {
    squares.push_back(std::pow(level.x / scale, 2));
    variances.push_back(level.variance(level.residuals));
    mean += variances.back() / static_cast<double>(levels.size());
    share += variances.back() * squares.back();
    square_sum += squares.back() * squares.back();
  }
  NoiseModel model{mean, 0};
  try {
    const Regression line = regress_polynomial(squares, variances, 0, 1);
    if (line.estimates[0] > 0 && line.estimates[1] >= 0) {
      model = {line.estimates[0], line.estimates[1] / (scale * scale)};
    } else if (line.estimates[0] <= 0 && share > 0) {
      // All of it grows; a hundredth of the mean keeps the lowest levels from weighing without limit.
      model = {0.01 * mean, share / square_sum / (scale * scale)};
    }
  } catch (const FitError&) {
  }
  return model;
}

/// k ω² (1 + c (ω − middle)/range) through all points: c is the change of k over the range.
Estimate change_of(std::span<const results::StepMean> steps, const std::map<int, double>& k, double slowest,
                   double fastest) {
  std::vector<std::vector<double>> rows;
  std::vector<double> thrusts;
  for (const results::StepMean& step : steps) {
    const double x = step.speed_rad_s * step.speed_rad_s;
    rows.emplace_back();
    double mean_k = 0;
    for (const auto& [repetition, run_k] : k) {
      rows.back().push_back(repetition == step.repetition ? x : 0);
      mean_k += run_k / static_cast<double>(k.size());
    }
    rows.back().push_back(mean_k * x * (step.speed_rad_s - 0.5 * (slowest + fastest)) / (fastest - slowest));
    thrusts.push_back(step.thrust_n);
  }
  const Regression fit = regress(rows, thrusts);
  return {fit.estimates.back(), fit.standard_errors.back(), static_cast<double>(fit.freedom)};
}

}  // namespace

SpeedDependence speed_dependence(double phi_deg, std::span<const results::StepMean> steps) {
  SpeedDependence result;
  result.phi_deg = phi_deg;
  result.lack_of_fit.statistic = "F";
  const std::map<int, double> k = k_of_runs(steps);
  std::vector<Level> complete;
  double xx = 0, residual_squares = 0, points = 0;
  for (const auto& [index, level] : levels_of(steps, k)) {
    LevelCoefficient row{level.speed, level.mean(level.local_k), std::numeric_limits<double>::quiet_NaN(),
                         level.residuals.size()};
    if (row.repetitions > 1) row.standard_error = std::sqrt(level.variance(level.local_k) / level.n());
    result.levels.push_back(row);
    xx += level.x * level.x;
    for (const double residual : level.residuals) residual_squares += residual * residual / level.n();
    ++points;
    if (level.residuals.size() == k.size()) complete.push_back(level);
  }
  std::sort(result.levels.begin(), result.levels.end(),
            [](const auto& a, const auto& b) { return a.speed_rad_s < b.speed_rad_s; });
  if (points < 3) return result;
  try {
    result.change = change_of(steps, k, result.levels.front().speed_rad_s, result.levels.back().speed_rad_s);
    result.trend = student_test(result.change, 0);
  } catch (const FitError&) {
  }
  const double runs = static_cast<double>(k.size()), n = static_cast<double>(complete.size());
  if (runs < 2 || n < 3) {
    result.inadequacy = std::sqrt(residual_squares / xx * points / (points - 1));
  } else {
    const NoiseModel noise = noise_of(complete, std::sqrt(xx / points));
    double between = 0, within = 0, excess = 0, sum_xx = 0;
    for (const Level& level : complete) {
      const double variance = noise.at(level.x), mean = level.mean(level.residuals);
      between += runs * mean * mean / variance;
      within += level.variance(level.residuals) * (runs - 1) / variance;
      excess += mean * mean - level.variance(level.residuals) / runs;
      sum_xx += level.x * level.x;
    }
    result.lack_of_fit = f_test(between / (n - 1) / (within / ((n - 1) * (runs - 1))), n - 1, (n - 1) * (runs - 1));
    if (result.lack_of_fit.rejected()) result.inadequacy = std::sqrt(std::max(0.0, excess / sum_xx));
  }
  result.lack_of_fit.name = fmt::format("lack of fit of T = k w^2 at phi = {} deg", phi_deg);
  result.lack_of_fit.hypothesis = "k does not depend on the speed";
  result.trend.name = fmt::format("trend of k with the speed at phi = {} deg", phi_deg);
  result.trend.hypothesis = result.lack_of_fit.hypothesis;
  return result;
}

}  // namespace kphi::fit
