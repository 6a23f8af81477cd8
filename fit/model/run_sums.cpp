#include "fit/model/run_sums.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace kphi::fit {
namespace {

double weight_of(const ThrustFit& fit, std::size_t i) { return fit.points[i].weight * fit.robust_weights[i]; }

double shape(const ThrustFit& fit, double k, std::size_t i) {
  return thrust(fit.parameters, fit.points[i].speed_rad_s) / k;
}

/// Zeros are linear in time between the two of a run, so that the ends of its steps show how far they went.
double zero_moved(std::span<const results::StepMean> steps, int repetition) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const results::StepMean& step : steps) {
    if (step.repetition != repetition || !std::isfinite(step.zero_n)) continue;
    low = std::min(low, step.zero_n);
    high = std::max(high, step.zero_n);
  }
  return high > low ? high - low : 0;
}

/// What one step index left unexplained in each run that has it.
struct LevelResiduals {
  double wx = 0, count = 0, sum = 0, squares = 0;
};

}  // namespace

std::vector<RunSums> sums_of_runs(double phi_deg, std::span<const results::StepMean> steps, const ThrustFit& fit,
                                  double k) {
  std::map<int, RunSums> runs;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    RunSums& run = runs[steps[i].repetition];
    const double w = weight_of(fit, i), x = shape(fit, k, i);
    run.xt += w * x * fit.points[i].thrust_n;
    run.xx += w * x * x;
    run.x += w * x;
    ++run.steps;
  }
  std::vector<RunSums> result;
  for (auto& [repetition, run] : runs) {
    run.phi_deg = phi_deg;
    run.repetition = repetition;
    run.zero_moved_n = zero_moved(steps, repetition);
    if (run.xx > 0) result.push_back(run);
  }
  return result;
}

WithinRuns scatter_within_runs(std::span<const results::StepMean> steps, const ThrustFit& fit, double k,
                               std::span<const RunSums> runs) {
  std::map<int, double> k_of;
  double xx = 0;
  for (const RunSums& run : runs) {
    k_of[run.repetition] = run.k();
    xx += run.xx / static_cast<double>(runs.size());
  }
  const bool repeated = runs.size() > 1;
  std::map<int, LevelResiduals> levels;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!k_of.contains(steps[i].repetition)) continue;
    const double x = shape(fit, k, i);
    const double residual = fit.points[i].thrust_n - k_of[steps[i].repetition] * x;
    LevelResiduals& level = levels[steps[i].step];
    level.wx += weight_of(fit, i) * x;
    level.sum += residual;
    level.squares += residual * residual;
    ++level.count;
  }
  WithinRuns result;
  double sum = 0, square_sum = 0, counted = 0;
  for (const auto& [index, level] : levels) {
    if (repeated && level.count < 2) continue;
    const double variance =
        repeated ? (level.squares - level.sum * level.sum / level.count) / (level.count - 1) : level.squares;
    const double part = std::pow(level.wx / level.count, 2) * variance;
    const double freedom = repeated ? level.count - 1 : 1;
    sum += part;
    square_sum += std::pow(std::pow(level.wx / level.count, 2), 2) / freedom;
    counted += std::pow(level.wx / level.count, 2);
  }
  const double n = static_cast<double>(levels.size());
  if (!(counted > 0) || n < 2) return result;
  result.variance = sum / (xx * xx) * n / (n - 1);  // one k per run was fitted
  result.freedom = counted * counted / square_sum * (n - 1) / n;
  return result;
}

}  // namespace kphi::fit
