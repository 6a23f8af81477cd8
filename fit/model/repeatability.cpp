#include "fit/model/repeatability.hpp"

#include <algorithm>
#include <cmath>

namespace kphi::fit {
namespace {

double count(const AngleScatter& angle) { return static_cast<double>(angle.runs.size()); }

/// k of one run as a share of that of its φ, with the variance that its noise and its own zero explain.
struct RunShare {
  double k = 0, variance = 0;
};

std::vector<RunShare> shares_of(const AngleScatter& angle) {
  std::vector<RunShare> shares;
  for (const RunSums& run : angle.runs) {
    const double zero = run.zero_moved_n / std::sqrt(12.0) * angle.zero_sensitivity;
    shares.push_back({run.k() / angle.k, (angle.within.variance + zero * zero) / (angle.k * angle.k)});
  }
  return shares;
}

double freedom_of(const std::vector<std::vector<RunShare>>& angles) {
  double freedom = 0;
  for (const auto& runs : angles) freedom += runs.empty() ? 0 : static_cast<double>(runs.size() - 1);
  return freedom;
}

/// χ² of the runs about the mean of their φ, were the variance from run to run larger by `beyond`.
double chi_squared(const std::vector<std::vector<RunShare>>& angles, double beyond) {
  double sum = 0;
  for (const auto& runs : angles) {
    const double n = static_cast<double>(runs.size());
    if (n < 2) continue;
    double mean = 0, variances = 0;
    for (const RunShare& run : runs) {
      mean += run.k / n;
      variances += run.variance + beyond;
    }
    for (const RunShare& run : runs) {
      const double variance = (run.variance + beyond) * (1 - 2 / n) + variances / (n * n);
      sum += std::pow(run.k - mean, 2) / variance * (n - 1) / n;
    }
  }
  return sum;
}

/// The variance from run to run at which χ² is what is to be expected (Mandel, Paule, Anal. Chem. 42 (1970) 1194).
double scatter_beyond(const std::vector<std::vector<RunShare>>& angles) {
  const double freedom = freedom_of(angles);
  double low = 0, high = 1e-12;
  if (chi_squared(angles, 1e-16) <= freedom) return 0;
  while (chi_squared(angles, high) > freedom) high *= 4;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (chi_squared(angles, middle) > freedom ? low : high) = middle;
  }
  return high;
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
  std::vector<std::vector<RunShare>> shares;
  for (const AngleScatter& angle : angles)
    if (angle.k != 0) shares.push_back(shares_of(angle));
  const double freedom = freedom_of(shares);
  result.angles = std::move(angles);
  result.repeated = freedom > 0;
  if (result.repeated) result.between = {0, std::sqrt(scatter_beyond(shares)), freedom};
  return result;
}

std::vector<OutlyingRun> outlying_runs(const Repeatability& all) {
  std::vector<std::vector<RunShare>> angles;
  std::size_t runs = 0;
  for (const AngleScatter& angle : all.angles) {
    angles.push_back(shares_of(angle));
    if (angle.runs.size() > 1) runs += angle.runs.size();
  }
  std::vector<OutlyingRun> outlying;
  for (std::size_t i = 0; i < angles.size(); ++i) {
    for (std::size_t r = 0; r < angles[i].size() && angles[i].size() > 1; ++r) {
      auto others = angles;
      others[i].erase(others[i].begin() + static_cast<std::ptrdiff_t>(r));
      const double freedom = freedom_of(others);
      if (freedom < 2) continue;
      const double beyond = scatter_beyond(others), n = static_cast<double>(others[i].size());
      double mean = 0, variance = angles[i][r].variance + beyond;
      for (const RunShare& other : others[i]) {
        mean += other.k / n;
        variance += (other.variance + beyond) / (n * n);
      }
      const HypothesisTest test = student_test({angles[i][r].k, std::sqrt(variance), freedom}, mean);
      const double p = std::min(1.0, test.p * static_cast<double>(runs));
      const RunSums& run = all.angles[i].runs[r];
      if (p < kTestLevel) outlying.push_back({run.phi_deg, run.repetition, angles[i][r].k / mean - 1, p});
    }
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
