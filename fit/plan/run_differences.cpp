#include "fit/plan/run_differences.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace kphi::fit {
namespace {

constexpr std::size_t kLeastSteps = 4, kMostSteps = 200;

/// d less factor · x + zero, by least squares.
std::vector<double> without_line(std::vector<double> d, std::span<const SharedStep> steps) {
  double n = 0, sx = 0, sxx = 0, sd = 0, sxd = 0;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double x = steps[i].x;
    ++n;
    sx += x;
    sxx += x * x;
    sd += d[i];
    sxd += x * d[i];
  }
  const double factor = (n * sxd - sx * sd) / (n * sxx - sx * sx), zero = (sd - factor * sx) / n;
  for (std::size_t i = 0; i < steps.size(); ++i) d[i] -= factor * steps[i].x + zero;
  return d;
}

std::vector<SharedStep> shared_steps(std::span<const results::StepMean> measured, std::size_t runs) {
  std::map<int, SharedStep> levels;
  for (const results::StepMean& step : measured) levels[step.step].of_runs.push_back(&step);
  std::vector<SharedStep> steps;
  for (auto& [number, level] : levels) {
    if (level.of_runs.size() != runs) continue;
    const double n = static_cast<double>(runs);
    double speed = 0;
    for (const results::StepMean* step : level.of_runs) {
      level.thrust_n += step->thrust_n / n;
      speed += step->speed_rad_s / n;
    }
    level.x = speed * speed;
    std::ranges::sort(level.of_runs, {}, &results::StepMean::repetition);
    steps.push_back(std::move(level));
  }
  return steps;
}

/// The walk between two zeros, tied at both ends, less the factor and the zero that are fitted to each run.
void add_wander(std::vector<SharedStep>& steps, RunDifferences& result) {
  const auto n = static_cast<Eigen::Index>(steps.size());
  if (steps.size() > kMostSteps) return;
  double begin = std::numeric_limits<double>::infinity(), end = -begin;
  for (const SharedStep& step : steps) {
    begin = std::min(begin, step.of_runs.front()->window_begin_s);
    end = std::max(end, step.of_runs.front()->window_end_s);
  }
  if (!(end > begin)) return;
  Eigen::MatrixXd walk(n, n), x(n, 2);
  Eigen::VectorXd share(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const results::StepMean& step = *steps[static_cast<std::size_t>(i)].of_runs.front();
    share(i) = (0.5 * (step.window_begin_s + step.window_end_s) - begin) / (end - begin);
    x.row(i) << 1, steps[static_cast<std::size_t>(i)].x / steps.back().x;
  }
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) walk(i, j) = std::min(share(i), share(j)) - share(i) * share(j);
  const Eigen::MatrixXd rest = Eigen::MatrixXd::Identity(n, n) - x * (x.transpose() * x).ldlt().solve(x.transpose());
  const Eigen::MatrixXd left = rest * walk * rest.transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    steps[static_cast<std::size_t>(i)].of_wander = left(i, i);
    if (i > 0) result.neighbours_of_wander += left(i - 1, i) / static_cast<double>(n - 1);
  }
}

}  // namespace

RunDifferences run_differences(std::span<const results::StepMean> measured) {
  std::set<int> runs;
  for (const results::StepMean& step : measured) runs.insert(step.repetition);
  RunDifferences result;
  if (runs.size() < 2) return result;
  std::vector<SharedStep> steps = shared_steps(measured, runs.size());
  if (steps.size() < kLeastSteps) return result;
  const double n = static_cast<double>(runs.size()), count = static_cast<double>(steps.size());
  const double freedom = (n - 1) * (count - 2) / count;  // of each step
  std::vector<std::vector<double>> left;
  for (std::size_t run = 0; run < runs.size(); ++run) {
    std::vector<double> d;
    for (const SharedStep& step : steps) {
      // As if every run had met the same speed.
      const double speed = step.of_runs[run]->speed_rad_s;
      d.push_back(step.of_runs[run]->thrust_n - step.thrust_n * speed * speed / step.x);
    }
    left.push_back(without_line(d, steps));
    for (std::size_t i = 0; i < steps.size(); ++i) steps[i].noise_n2 += left.back()[i] * left.back()[i] / freedom;
  }
  const double pairs = n * (count - 1);
  for (const std::vector<double>& run : left)
    for (std::size_t i = 1; i < run.size(); ++i) result.neighbours_n2 += run[i - 1] * run[i] / pairs * n / (n - 1);
  for (const SharedStep& step : steps) result.neighbours_n2 += 2 / count * step.noise_n2 / count;
  add_wander(steps, result);
  result.steps = std::move(steps);
  return result;
}

}  // namespace kphi::fit
