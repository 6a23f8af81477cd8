#include "results/reduction/repetitions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>

#include "base/statistics.hpp"
#include "results/reduction/good_steps.hpp"
#include "results/reduction/run_scatter.hpp"
#include "results/reduction/run_zero.hpp"

namespace kphi::results {
namespace {
using Group = StepGroup;

using Runs = std::map<int, Group>;  // by repetition

std::set<int> good_levels(const Group& run) {
  std::set<int> levels;
  for (const StepMean* step : run) {
    if (is_good(*step)) levels.insert(step->step);
  }
  return levels;
}

/// k and its uncertainty, over these levels.
void fit_k(const Group& run, const std::set<int>& levels, const ZeroMovement& movement, RepetitionFigure& figure) {
  double tx = 0, xx = 0, x_sum = 0, variance = 0;
  SharedZero zero;
  for (const StepMean* step : run) {
    if (!levels.contains(step->step)) continue;
    const double x = square(step->speed_rad_s);
    tx += step->thrust_n * x;
    xx += x * x;
    x_sum += x;
    variance += square(x * thrust_u(*step));
    zero.add(*step, x);
  }
  figure.k = tx / xx;
  figure.per_n = x_sum / xx;
  figure.u = std::sqrt(variance + square(zero.u_n(movement.of_run_n(*run.front())) * x_sum)) / xx;
}

std::vector<RepetitionFigure> figures_of(const Runs& runs, const ZeroMovement& movement) {
  std::vector<RepetitionFigure> figures;
  std::optional<std::set<int>> common;
  for (const auto& [repetition, run] : runs) {
    const std::set<int> levels = good_levels(run);
    figures.push_back({.repetition = repetition, .usable = !levels.empty() && 2 * levels.size() >= run.size()});
    for (const StepMean* step : run) figures.back().flags.add(step->quality_flags & ~kHarmlessFlags);
    if (!figures.back().usable) continue;
    if (!common) common = levels;
    std::erase_if(*common, [&](int level) { return !levels.contains(level); });
  }
  for (RepetitionFigure& figure : figures) {
    if (figure.usable && !common->empty()) fit_k(runs.at(figure.repetition), *common, movement, figure);
  }
  return figures;
}

std::vector<double> known(const std::vector<RepetitionFigure>& figures, double RepetitionFigure::*member) {
  std::vector<double> values;
  for (const RepetitionFigure& figure : figures)
    if (!std::isnan(figure.k)) values.push_back(figure.*member);
  return values;
}

/// By Hampel's identifier, among the repetitions of one occlusion.
void judge_alone(RepetitionVerdict& verdict, const RepetitionRule& rule) {
  const std::vector<double> k = known(verdict.repetitions, &RepetitionFigure::k);
  if (k.size() < 3) return;
  std::vector<double> away;
  for (const double value : k) away.push_back(std::abs(value - verdict.k));
  const double scale = std::max({1.4826 * median(away), median(known(verdict.repetitions, &RepetitionFigure::u)),
                                 rule.least_share * std::abs(verdict.k)});
  for (RepetitionFigure& figure : verdict.repetitions) {
    figure.away = figure.k / verdict.k - 1;
    figure.outlying = std::abs(figure.k - verdict.k) > rule.threshold * scale;
  }
}

/// By Student's test: run `r` of occlusion `o` against the others, `all` runs being tested.
void judge_among_all(RepetitionFigure& figure, std::vector<std::vector<RunShare>> others, std::size_t o, std::size_t r,
                     double all, const RepetitionRule& rule) {
  const RunShare run = others[o][r];
  others[o].erase(others[o].begin() + static_cast<std::ptrdiff_t>(r));
  const RunScatter beyond = scatter_between(others, Keep::likeliest);
  const auto whole = [&](const RunShare& one) {
    return one.variance + square(beyond.share) + square(beyond.zero_n * one.per_n);
  };
  const double n = static_cast<double>(others[o].size());
  double mean = 0, variance = whole(run);
  for (const RunShare& other : others[o]) {
    mean += other.k / n;
    variance += whole(other) / (n * n);
  }
  const boost::math::students_t student(freedom_between(others));
  const double chance = 2 * boost::math::cdf(complement(student, std::abs(run.k - mean) / std::sqrt(variance)));
  figure.p = std::min(1.0, all * chance);
  figure.away = run.k / mean - 1;
  figure.outlying = figure.p < rule.level && std::abs(figure.away) > rule.threshold * rule.least_share;
}

/// Fills `k` of the verdicts and marks the outlying repetitions.
void judge(std::vector<RepetitionVerdict>& verdicts, const RepetitionRule& rule) {
  std::vector<std::vector<RunShare>> shares;
  double all = 0;
  for (RepetitionVerdict& verdict : verdicts) {
    const std::vector<double> k = known(verdict.repetitions, &RepetitionFigure::k);
    if (!k.empty()) verdict.k = median(k);
    shares.emplace_back();
    for (const RepetitionFigure& figure : verdict.repetitions) {
      if (!std::isnan(figure.k))
        shares.back().push_back({figure.k / verdict.k, square(figure.u / verdict.k), figure.per_n / verdict.k});
    }
    if (k.size() > 1) all += static_cast<double>(k.size());
  }
  const double freedom = freedom_between(shares);
  for (std::size_t o = 0; o < verdicts.size(); ++o) {
    if (shares[o].size() < 2) continue;
    if (freedom < 3) {
      judge_alone(verdicts[o], rule);
      continue;
    }
    std::size_t r = 0;
    for (RepetitionFigure& figure : verdicts[o].repetitions)
      if (!std::isnan(figure.k)) judge_among_all(figure, shares, o, r++, all, rule);
  }
}

/// One-way analysis of variance: the repetitions are the groups, and how certain each is comes from within it.
void analyse(RepetitionVerdict& verdict, double freedom_within) {
  const std::vector<double> k = known(verdict.repetitions, &RepetitionFigure::k);
  const double n = static_cast<double>(k.size());
  if (k.size() < 2) return;
  double u_squares = 0;
  for (const double u : known(verdict.repetitions, &RepetitionFigure::u)) u_squares += square(u);
  verdict.between_sd = std::sqrt(variance(k));
  verdict.within_u = std::sqrt(u_squares / n);
  if (!(verdict.within_u > 0)) return;
  verdict.f = square(verdict.between_sd / verdict.within_u);
  const boost::math::fisher_f distribution(n - 1, std::max(freedom_within, 1.0));
  verdict.p = boost::math::cdf(boost::math::complement(distribution, verdict.f));
}

double freedom_within(const Group& steps) {
  double freedom = 0;
  for (const StepMean* step : steps)
    if (is_good(*step)) freedom += std::isnan(step->thrust_freedom) ? 1 : std::min(step->thrust_freedom, 1e3);
  return freedom;
}

void decide(RepetitionVerdict& verdict, const RepetitionRule& rule) {
  std::vector<double> k;
  for (const RepetitionFigure& figure : verdict.repetitions) {
    if (!figure.usable) {
      verdict.reason =
          fmt::format("repetition {} has too few good steps: {}", figure.repetition, in_words(figure.flags));
    } else if (figure.outlying) {
      verdict.reason =
          fmt::format("repetition {} gives a k that is {:+.2f} % off the others ({})", figure.repetition,
                      100 * figure.away, std::isnan(figure.p) ? "Hampel" : fmt::format("p = {:.2g}", figure.p));
    } else {
      k.push_back(figure.k);
    }
  }
  const auto runs = static_cast<int>(verdict.repetitions.size());
  const auto [low, high] = std::ranges::minmax_element(k);
  const bool spread = k.size() > 1 && verdict.p < 0.05 && *high - *low > rule.spread_share * std::abs(verdict.k);
  if (spread && verdict.reason.empty()) {
    verdict.reason = fmt::format("the repetitions spread over {:.2f} % of k, and none stands out",
                                 100 * (*high - *low) / std::abs(verdict.k));
  }
  const bool too_few = static_cast<int>(k.size()) < rule.wanted || spread;
  verdict.asks_for_another = runs >= rule.wanted && runs < rule.at_most && too_few;
}

}  // namespace

std::vector<RepetitionVerdict> judge_repetitions(std::span<const StepMean> steps, const RepetitionRule& rule) {
  const auto key = [](const StepMean& step) { return std::pair(step.propeller, step.occlusion_deg); };
  std::vector<StepMean> measured;
  std::ranges::copy_if(steps, std::back_inserter(measured), [](const StepMean& step) { return step.repetition != 0; });
  const std::vector<Group> groups = groups_of(measured, key);
  ZeroMovement movement;
  for (const StepMean& step : measured)
    if (is_good(step)) movement.add(step);
  std::vector<RepetitionVerdict> verdicts;
  for (const Group& group : groups) {
    Runs runs;
    for (const StepMean* step : group) runs[step->repetition].push_back(step);
    verdicts.push_back({group.front()->propeller, group.front()->occlusion_deg, figures_of(runs, movement)});
  }
  judge(verdicts, rule);
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    analyse(verdicts[i], freedom_within(groups[i]));
    decide(verdicts[i], rule);
  }
  return verdicts;
}

}  // namespace kphi::results
