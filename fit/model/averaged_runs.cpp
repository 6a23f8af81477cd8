#include "fit/model/averaged_runs.hpp"

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"

namespace kphi::fit {
namespace {

bool is_average(const results::StepMean& step) { return step.repetition == 0; }

/// The same of rows as one repetition has them: its zero is less certain than the mean of all.
std::vector<results::StepMean> of_one_repetition(std::span<const results::StepMean> rows) {
  std::vector<results::StepMean> result(rows.begin(), rows.end());
  for (results::StepMean& row : result) row.zero_u_n *= std::sqrt(row.repetitions_averaged);
  return result;
}

/// As scatter_within_runs(), from the standard deviations in the rows.
WithinRuns within_of(std::span<const results::StepMean> rows, const ThrustFit& fit, double k, double xx) {
  double sum = 0, square_sum = 0, counted = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double n = rows[i].repetitions_averaged;
    if (!(n > 1) || std::isnan(rows[i].thrust_scatter_n)) continue;
    const double x = thrust(fit.parameters, fit.points[i].speed_rad_s) / k;
    const double share = square(fit.points[i].weight * fit.robust_weights[i] * x / n);
    sum += share * square(rows[i].thrust_scatter_n);
    square_sum += square(share) / (n - 1);
    counted += share;
  }
  const double levels = static_cast<double>(rows.size());
  if (!(counted > 0) || levels < 2) return {};
  return {sum / square(xx) * levels / (levels - 1), square(counted) / square_sum * (levels - 1) / levels};
}

/// Of k at a level that is alone: what a row's thrust scatters about the k of its run does not average out.
double alone_share(std::span<const results::StepMean> rows, const ThrustFit& fit, double k) {
  double share = 0;
  int levels = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!(fit.points[i].weight > 0)) continue;
    ++levels;
    share = rows[i].thrust_scatter_n / std::abs(thrust(fit.parameters, fit.points[i].speed_rad_s) / k * k);
  }
  return levels == 1 && std::isfinite(share) ? share : 0;
}

}  // namespace

std::optional<int> repetitions_averaged(std::span<const results::StepMean> steps) {
  double most = 0;
  for (const results::StepMean& step : steps)
    if (is_average(step)) most = std::fmax(most, step.repetitions_averaged);
  return most > 0 ? std::optional(static_cast<int>(most)) : std::nullopt;
}

bool averages_unknown(std::span<const results::StepMean> steps) {
  return std::ranges::any_of(
      steps, [](const auto& step) { return is_average(step) && std::isnan(step.repetitions_averaged); });
}

std::optional<AveragedRuns> averaged_runs(double phi_deg, std::span<const results::StepMean> rows, const ThrustFit& fit,
                                          double k, const results::ZeroMovement& movement) {
  const int count = averages_unknown(rows) ? 0 : repetitions_averaged(rows).value_or(0);
  const auto tells = std::ranges::find_if(rows, [](const auto& row) { return row.k_scatter_share >= 0; });
  if (count < 2 || tells == rows.end()) return std::nullopt;
  const double n = count, share = std::hypot(tells->k_scatter_share, alone_share(rows, fit, k));
  const std::vector<results::StepMean> of_one = of_one_repetition(rows);
  AveragedRuns result;
  double xx = 0;
  for (int i = 0; i < count; ++i) {
    // Evenly apart, with the standard deviation that the rows tell: what comes after uses their squares alone.
    const double apart = (i - (n - 1) / 2) / std::sqrt(n * (n + 1) / 12);
    ThrustFit one = fit;
    for (Point& point : one.points) {
      point.thrust_n *= 1 + share * apart;
      point.weight /= n;
    }
    for (RunSums& run : sums_of_runs(phi_deg, of_one, one, k, movement)) {
      run.repetition = i + 1;
      xx += run.xx / n;
      result.runs.push_back(run);
    }
  }
  result.within = within_of(rows, fit, k, xx);
  return result;
}

}  // namespace kphi::fit
