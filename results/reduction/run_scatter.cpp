#include "results/reduction/run_scatter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/statistics.hpp"

namespace kphi::results {

namespace {

/// Sum of the squares of `freedom` deviations, whose variance is known + of_share · share + of_zero · zero.
struct Sample {
  double freedom = 0, squares = 0, known = 0, of_share = 0, of_zero = 0;
};

Sample sample_of(const std::vector<RunShare>& runs, double RunShare::*value, double RunShare::*known) {
  const double n = static_cast<double>(runs.size());
  Sample sample{.freedom = n - 1};
  double middle = 0;
  for (const RunShare& run : runs) {
    middle += run.*value / n;
    sample.known += run.*known / n;
  }
  for (const RunShare& run : runs) sample.squares += square(run.*value - middle);
  return sample;
}

std::vector<Sample> samples_of(std::span<const std::vector<RunShare>> occlusions) {
  std::vector<Sample> samples;
  for (const auto& runs : occlusions) {
    if (runs.size() < 2) continue;
    Sample k = sample_of(runs, &RunShare::k, &RunShare::variance);
    k.of_share = 1;
    for (const RunShare& run : runs) k.of_zero += square(run.per_n) / static_cast<double>(runs.size());
    samples.push_back(k);
    if (std::ranges::any_of(runs, [](const RunShare& run) { return !(run.offset_variance > 0); })) continue;
    Sample offset = sample_of(runs, &RunShare::offset_n, &RunShare::offset_variance);
    // What is not explained adds to both as what is explained does.
    offset.of_zero = k.known > 0 ? offset.known * k.of_zero / k.known : 1;
    samples.push_back(offset);
  }
  for (Sample& one : samples) one.known = std::max({one.known, 1e-6 * one.squares, 1e-30});
  return samples;
}

/// The two variances, and Fisher's information of them.
struct Fit {
  double share = 0, zero = 0;
  double of_share = 0, of_both = 0, of_zero = 0;

  [[nodiscard]] double variance(const Sample& one) const {
    return one.known + one.of_share * share + one.of_zero * zero;
  }
  void inform(const std::vector<Sample>& samples) {
    of_share = of_both = of_zero = 0;
    for (const Sample& one : samples) {
      const double weight = 0.5 * one.freedom / square(variance(one));
      of_share += weight * square(one.of_share);
      of_both += weight * one.of_share * one.of_zero;
      of_zero += weight * square(one.of_zero);
    }
  }
  /// Twice the logarithm of the restricted likelihood.
  [[nodiscard]] double likelihood(const std::vector<Sample>& samples) const {
    double sum = 0;
    for (const Sample& one : samples) sum -= one.freedom * std::log(variance(one)) + one.squares / variance(one);
    return sum;
  }
  /// Degrees of freedom: twice the square of a variance over the variance of its estimate. Each as if the other one was
  /// known: what one takes from the other leaves their sum, which a budget makes of them, as certain.
  [[nodiscard]] RunScatter scatter() const {
    const auto freedom = [](double size, double information) {
      return size > 0 ? std::max(1.0, 2 * square(size) * information) : 0;
    };
    return {std::sqrt(share), freedom(share, of_share), std::sqrt(zero), freedom(zero, of_zero)};
  }
};

/// By Fisher's scoring: least squares of the variances, each weighed by what the last round makes of it, none below 0.
Fit fit_of(const std::vector<Sample>& samples, bool with_share, bool with_zero) {
  constexpr int kMostRounds = 400;
  constexpr double kConverged = 1e-12;  // of all that scatters
  Fit fit;
  for (const Sample& one : samples) {
    if (with_share && one.of_share > 0) fit.share = std::max(fit.share, one.squares / one.freedom);
    if (with_zero && one.of_zero > 0) fit.zero = std::max(fit.zero, one.squares / one.freedom / one.of_zero);
  }
  const double least_share = kConverged * fit.share, least_zero = kConverged * fit.zero;
  bool moves = true;
  for (int round = 0; moves && round < kMostRounds; ++round) {
    fit.inform(samples);
    double share = 0, zero = 0;
    for (const Sample& one : samples) {
      const double beyond = 0.5 * (one.squares - one.freedom * one.known) / square(fit.variance(one));
      share += one.of_share * beyond;
      zero += one.of_zero * beyond;
    }
    const double determinant = fit.of_share * fit.of_zero - square(fit.of_both);
    double next_share = with_share ? std::max(0.0, share / fit.of_share) : 0, next_zero = 0;
    if (with_zero && !with_share) next_zero = std::max(0.0, zero / fit.of_zero);
    if (with_zero && with_share && determinant > 1e-9 * fit.of_share * fit.of_zero) {
      const double both = (fit.of_zero * share - fit.of_both * zero) / determinant;
      next_zero = (fit.of_share * zero - fit.of_both * share) / determinant;
      next_share = next_zero < 0 ? next_share : both;
      if (next_share < 0) next_share = 0, next_zero = zero / fit.of_zero;
      next_zero = std::max(0.0, next_zero);
    }
    moves = std::abs(next_share - fit.share) > least_share || std::abs(next_zero - fit.zero) > least_zero;
    fit.share = 0.5 * (fit.share + next_share);
    fit.zero = 0.5 * (fit.zero + next_zero);
  }
  return fit;
}

}  // namespace

double freedom_between(std::span<const std::vector<RunShare>> occlusions) {
  double freedom = 0;
  for (const auto& runs : occlusions) freedom += runs.empty() ? 0 : static_cast<double>(runs.size() - 1);
  return freedom;
}

RunScatter scatter_between(std::span<const std::vector<RunShare>> occlusions, Keep keep) {
  const std::vector<Sample> samples = samples_of(occlusions);
  const bool may_add = std::ranges::any_of(samples, [](const Sample& one) { return one.of_zero > 0; });
  struct Model {
    Fit fit;
    double likelihood;  ///< twice the logarithm, less what its components cost
  };
  std::vector<Model> models;
  for (const auto& [share, zero] : {std::pair{false, false}, {true, false}, {false, true}, {true, true}}) {
    if ((zero && !may_add) || (share && samples.empty())) continue;
    const Fit fit = fit_of(samples, share, zero);
    models.push_back({fit, fit.likelihood(samples) - (keep == Keep::averaged ? 2.0 * (share + zero) : 0)});
  }
  const Model& best = *std::ranges::max_element(models, {}, &Model::likelihood);
  Fit fit = best.fit;
  if (keep == Keep::averaged) {
    // None is chosen: each counts as much as it is likely (weights of Akaike).
    fit = {};
    double weights = 0;
    for (const Model& model : models) weights += std::exp(0.5 * (model.likelihood - best.likelihood));
    for (const Model& model : models) {
      const double weight = std::exp(0.5 * (model.likelihood - best.likelihood)) / weights;
      fit.share += weight * model.fit.share;
      fit.zero += weight * model.fit.zero;
    }
  }
  fit.inform(samples);
  RunScatter scatter = fit.scatter();
  if (!(fit.share > 0)) scatter.share_freedom = freedom_between(occlusions);
  return scatter;
}

RunScatter scatter_expected(double share, double zero_n, std::span<const std::vector<RunShare>> occlusions) {
  Fit fit{square(share), square(zero_n)};
  fit.inform(samples_of(occlusions));
  return fit.scatter();
}

}  // namespace kphi::results
