#include "fit/model/repeatability.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "base/statistics.hpp"
#include "results/reduction/repetitions.hpp"
#include "results/reduction/run_scatter.hpp"
#include "results/reduction/run_zero.hpp"

namespace kphi::fit {
namespace {

double weight_of(const ThrustFit& fit, std::size_t i) { return fit.points[i].weight * fit.robust_weights[i]; }

double shape(const ThrustFit& fit, double k, std::size_t i) {
  return thrust(fit.parameters, fit.points[i].speed_rad_s) / k;
}

/// Residuals of one step index over the runs that have it.
struct LevelResiduals {
  double wx = 0, count = 0, sum = 0, squares = 0, in_offset = 0, leverage = 0;
};

constexpr double kLeastLeft = 0.1;  // of a step's variance in its residual: a line takes nearly all of a third step

double count(const AngleScatter& angle) { return static_cast<double>(angle.runs.size()); }

std::vector<results::RunShare> shares_of(const AngleScatter& angle) {
  std::vector<results::RunShare> shares;
  for (const RunSums& run : angle.runs) {
    const bool offset = angle.within.offset_variance > 0 && run.has_offset();
    shares.push_back({run.k() / angle.k,
                      (angle.within.variance + square(run.zero_u_n * angle.zero_sensitivity)) / square(angle.k),
                      angle.zero_sensitivity / angle.k, offset ? run.offset() : 0,
                      offset ? angle.within.offset_variance + square(run.offset_zero_u_n) : 0});
  }
  return shares;
}

double between_u(const Repeatability& all, const AngleScatter& angle) {
  return all.between.u * std::abs(angle.k) / std::sqrt(std::max(1.0, count(angle)));
}

double zero_beyond_u(const Repeatability& all, const AngleScatter& angle) {
  return all.zero_beyond.u * angle.zero_sensitivity / std::sqrt(std::max(1.0, count(angle)));
}

}  // namespace

std::vector<RunSums> sums_of_runs(double phi_deg, std::span<const results::StepMean> steps, const ThrustFit& fit,
                                  double k, const results::ZeroMovement& movement) {
  std::map<int, RunSums> runs;
  std::map<int, double> moved;
  std::map<int, results::SharedZero> zeros;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    RunSums& run = runs[steps[i].repetition];
    moved.try_emplace(steps[i].repetition, movement.of_run_n(steps[i]));
    const double w = weight_of(fit, i), x = shape(fit, k, i);
    run.xt += w * x * fit.points[i].thrust_n;
    run.xx += w * x * x;
    run.x += w * x;
    run.w += w;
    run.t += w * fit.points[i].thrust_n;
    zeros[steps[i].repetition].add(steps[i], w * x);
  }
  std::map<int, results::SharedZero> in_offset;
  for (std::size_t i = 0; i < steps.size(); ++i)
    if (const RunSums& run = runs.at(steps[i].repetition); run.has_offset())
      in_offset[steps[i].repetition].add(steps[i], run.in_offset(weight_of(fit, i), shape(fit, k, i)));
  std::vector<RunSums> result;
  for (auto& [repetition, run] : runs) {
    run.phi_deg = phi_deg;
    run.repetition = repetition;
    run.zero_u_n = zeros.at(repetition).u_n(moved.at(repetition));
    run.offset_zero_u_n = in_offset[repetition].u_n(moved.at(repetition));
    if (run.xx > 0) result.push_back(run);
  }
  return result;
}

WithinRuns scatter_within_runs(std::span<const results::StepMean> steps, const ThrustFit& fit, double k,
                               std::span<const RunSums> runs) {
  std::map<int, const RunSums*> run_of;
  double xx = 0;
  for (const RunSums& run : runs) {
    run_of[run.repetition] = &run;
    xx += run.xx / static_cast<double>(runs.size());
  }
  std::map<int, LevelResiduals> levels;
  for (const results::StepMean& step : steps) levels[step.step];
  const bool repeated = runs.size() > 1,
             lines = repeated && levels.size() > 2 && std::ranges::all_of(runs, &RunSums::has_offset);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (!run_of.contains(steps[i].repetition)) continue;
    const RunSums& run = *run_of[steps[i].repetition];
    const double x = shape(fit, k, i), w = weight_of(fit, i);
    const double residual = fit.points[i].thrust_n - (lines ? run.offset() + run.slope() * x : run.k() * x);
    LevelResiduals& level = levels[steps[i].step];
    level.wx += w * x;
    if (lines) level.in_offset += run.in_offset(w, x);
    level.leverage +=
        lines ? run.in_offset(w, x) + w * x * (run.w * x - run.x) / run.determinant() : w * x * x / run.xx;
    level.sum += residual;
    level.squares += residual * residual;
    ++level.count;
  }
  WithinRuns result;
  double sum = 0, square_sum = 0, counted = 0;
  for (const auto& [index, level] : levels) {
    if (repeated && level.count < 2) continue;
    const double squares = repeated ? level.squares - level.sum * level.sum / level.count : level.squares;
    const double freedom = repeated ? level.count - 1 : 1, weight = square(level.wx / level.count);
    const double variance = squares / freedom / std::max(kLeastLeft, 1 - level.leverage / level.count);
    sum += weight * variance;
    square_sum += square(weight) / freedom;
    counted += weight;
    result.offset_variance += square(level.in_offset / level.count) * variance;
  }
  const double n = static_cast<double>(levels.size()), fitted = lines ? 2 : 1;  // for each run
  if (!(counted > 0) || n < 2) return {};
  result.variance = sum / (xx * xx);
  result.freedom = counted * counted / square_sum * (n - fitted) / n;
  return result;
}

double AngleScatter::within_u() const {
  return runs.empty() ? 0 : std::sqrt(within.variance / static_cast<double>(runs.size()));
}

AngleScatter scatter_of_angle(double k, std::vector<RunSums> runs, const WithinRuns& within) {
  AngleScatter angle;
  angle.k = k;
  angle.within = within;
  double x = 0, xx = 0, squares = 0;
  for (const RunSums& run : runs) {
    x += run.x;
    xx += run.xx;
    squares += run.zero_u_n * run.zero_u_n;
  }
  const double n = static_cast<double>(runs.size());
  if (xx > 0) angle.zero_sensitivity = x / xx;
  if (n > 0) angle.zero_u_n = std::sqrt(squares) / n;
  angle.runs = std::move(runs);
  return angle;
}

Repeatability repeatability(std::vector<AngleScatter> angles, const Estimate& zero_movement) {
  Repeatability result;
  result.zero_movement = zero_movement;
  std::vector<std::vector<results::RunShare>> shares;
  for (const AngleScatter& angle : angles)
    if (angle.k != 0) shares.push_back(shares_of(angle));
  result.angles = std::move(angles);
  result.repeated = results::freedom_between(shares) > 0;
  if (!result.repeated) return result;
  const results::RunScatter scatter = results::scatter_between(shares);
  result.between = {0, scatter.share, scatter.share_freedom};
  result.zero_beyond = {0, scatter.zero_n, scatter.zero_freedom};
  return result;
}

std::vector<OutlyingRun> outlying_runs(std::span<const results::StepMean> used) {
  std::vector<OutlyingRun> outlying;
  for (const results::RepetitionVerdict& verdict : results::judge_repetitions(used)) {
    for (const results::RepetitionFigure& run : verdict.repetitions)
      if (run.outlying) outlying.push_back({verdict.occlusion_deg, run.repetition, run.away, run.p});
  }
  return outlying;
}

double Repeatability::independent_u(std::size_t i) const {
  const AngleScatter& angle = angles[i];
  return std::sqrt(std::pow(angle.within_u(), 2) + std::pow(angle.zero_u(), 2) + std::pow(between_u(*this, angle), 2) +
                   std::pow(zero_beyond_u(*this, angle), 2) + std::pow(mounting.value_or(0) * angle.k, 2));
}

double Repeatability::freedom_of_zero() const {
  double told = 0, beyond = 0;
  for (const AngleScatter& angle : angles) {
    told += square(angle.zero_u_n);
    beyond += square(zero_beyond.u) / std::max(1.0, count(angle));
  }
  double spread = zero_movement.value > 0 ? square(told) / zero_movement.freedom : 0;
  if (beyond > 0) spread += square(beyond) / zero_beyond.freedom;
  return spread > 0 ? square(told + beyond) / spread : 0;
}

double Repeatability::freedom() const {
  double share = 0, zero_share = 0, within_share = 0, within_freedom = 0, n = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double whole = std::pow(independent_u(i), 2);
    if (!(whole > 0)) continue;
    share += std::pow(between_u(*this, angles[i]), 2) / whole;
    zero_share += std::pow(zero_beyond_u(*this, angles[i]), 2) / whole;
    within_share += std::pow(angles[i].within_u(), 2) / whole;
    within_freedom += angles[i].within.freedom;
    ++n;
  }
  double spread = 0;
  if (between.freedom > 0) spread += std::pow(share / n, 2) / between.freedom;
  if (zero_beyond.freedom > 0) spread += std::pow(zero_share / n, 2) / zero_beyond.freedom;
  if (within_freedom > 0) spread += std::pow(within_share / n, 2) / within_freedom;
  return spread > 0 ? 1 / spread : std::numeric_limits<double>::infinity();
}

}  // namespace kphi::fit
