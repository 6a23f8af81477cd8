#include "fit/repeatability.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::fit {
namespace {

double count(const AngleScatter& angle) { return static_cast<double>(angle.runs.size()); }

double mean_of(const AngleScatter& angle) {
  double mean = 0;
  for (const RunSums& run : angle.runs) mean += run.k() / count(angle);
  return mean;
}

double between_u(const Repeatability& all, const AngleScatter& angle) {
  return all.between.u * std::abs(angle.k) / std::sqrt(std::max(1.0, count(angle)));
}

}  // namespace

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
    squares += std::pow(run.zero_moved_n / 2, 2) / 3;
  }
  const double n = static_cast<double>(runs.size());
  if (xx > 0) angle.zero_sensitivity = x / xx;
  if (n > 0) angle.zero_u_n = std::sqrt(squares) / n;
  angle.runs = std::move(runs);
  return angle;
}

Repeatability repeatability(std::vector<AngleScatter> angles) {
  Repeatability result;
  double squares = 0, expected = 0, freedom = 0;
  for (const AngleScatter& angle : angles) {
    const double n = count(angle);
    if (n < 2 || angle.k == 0) continue;
    double mean = 0;
    for (const RunSums& run : angle.runs) mean += run.k() / n;
    for (const RunSums& run : angle.runs) squares += std::pow((run.k() - mean) / angle.k, 2);
    const double zero = angle.zero_u() * std::sqrt(n);  // of one run
    expected += (n - 1) * (angle.within.variance + zero * zero) / (angle.k * angle.k);
    freedom += n - 1;
  }
  result.angles = std::move(angles);
  result.repeated = freedom > 0;
  if (result.repeated) result.between = {0, std::sqrt(std::max(0.0, squares - expected) / freedom), freedom};
  return result;
}

std::vector<OutlyingRun> outlying_runs(const Repeatability& all) {
  double scatter = 0, noise = 0, freedom = 0;  // shares of k, squared
  for (const AngleScatter& angle : all.angles) {
    for (const RunSums& run : angle.runs) scatter += std::pow((run.k() - mean_of(angle)) / angle.k, 2);
    freedom += count(angle) - 1;
    noise += (count(angle) - 1) * angle.within.variance / (angle.k * angle.k);
  }
  const double beyond = std::max(0.0, scatter - noise) / freedom;
  std::vector<OutlyingRun> runs;
  std::vector<double> squared;  // deviations in their variance
  double squares = 0;
  for (const AngleScatter& angle : all.angles) {
    const double n = count(angle), mean = mean_of(angle);
    const double variance = (angle.within.variance + beyond * angle.k * angle.k) * (1 - 1 / n);
    for (const RunSums& run : angle.runs) {
      const double off = run.k() - mean;
      if (n < 2 || !(variance > 0)) continue;
      runs.push_back({run.phi_deg, run.repetition, run.k() / (mean - off / (n - 1)) - 1, 1});
      squared.push_back(off * off / variance);
      squares += squared.back() * (n - 1) / n;
    }
  }
  std::vector<OutlyingRun> outlying;
  for (std::size_t i = 0; i < runs.size(); ++i) {
    const double rest = (squares - squared[i]) / (freedom - 1);
    if (freedom < 3 || !(rest > 0)) continue;
    const StatisticalTest test = student_test({std::sqrt(squared[i]), std::sqrt(rest), freedom - 1}, 0);
    runs[i].p = std::min(1.0, test.p * static_cast<double>(runs.size()));
    if (runs[i].p < kTestLevel) outlying.push_back(runs[i]);
  }
  return outlying;
}

double Repeatability::independent_u(std::size_t i) const {
  const AngleScatter& angle = angles[i];
  return std::sqrt(std::pow(angle.within_u(), 2) + std::pow(angle.zero_u(), 2) + std::pow(between_u(*this, angle), 2));
}

double Repeatability::freedom() const {
  double share = 0, within_share = 0, within_freedom = 0, n = 0;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    const double whole = std::pow(independent_u(i), 2);
    if (!(whole > 0)) continue;
    share += std::pow(between_u(*this, angles[i]), 2) / whole;
    within_share += std::pow(angles[i].within_u(), 2) / whole;
    within_freedom += angles[i].within.freedom;
    ++n;
  }
  if (n == 0) return std::numeric_limits<double>::infinity();
  double spread = 0;
  if (between.freedom > 0) spread += std::pow(share / n, 2) / between.freedom;
  if (within_freedom > 0) spread += std::pow(within_share / n, 2) / within_freedom;
  return spread > 0 ? 1 / spread : std::numeric_limits<double>::infinity();
}

}  // namespace kphi::fit
