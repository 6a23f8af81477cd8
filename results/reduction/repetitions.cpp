#include "results/reduction/repetitions.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <tuple>
#include <type_traits>
#include <utility>

#include "base/statistics.hpp"
#include "compensation/units.hpp"

namespace kphi::results {
namespace {
using Group = std::vector<const StepMean*>;

constexpr double StepMean::*kMeans[] = {
    // of every run
    &StepMean::commanded_speed_rad_s, &StepMean::thrust_n, &StepMean::torque_nm, &StepMean::zero_n,
    &StepMean::supply_voltage_v, &StepMean::supply_current_a, &StepMean::motor_current_a, &StepMean::window_begin_s,
    &StepMean::coil_temperature_degc, &StepMean::window_end_s,
    // of some
    &StepMean::supply_v, &StepMean::supply_a, &StepMean::supply_w, &StepMean::air_density_kg_m3,
    &StepMean::air_density_u_kg_m3, &StepMean::discarded_s, &StepMean::zero_moved_n, &StepMean::lag_s};
constexpr double StepMean::*kRootMeanSquares[] = {&StepMean::speed_rad_s, &StepMean::speed_sd_rad_s,
                                                  &StepMean::thrust_sd_n, &StepMean::torque_sd_nm};
constexpr std::uint64_t StepMean::*kSums[] = {&StepMean::speed_n, &StepMean::thrust_samples, &StepMean::speed_glitches};
constexpr double StepMean::*kUncertainties[] = {&StepMean::thrust_u_n, &StepMean::speed_u_rad_s, &StepMean::zero_u_n,
                                                &StepMean::lag_u_s};

double square(double x) { return x * x; }

/// Mean of f(value) over the rows that have the value; NaN without any.
double mean_over(const Group& group, double StepMean::*member, auto f) {
  double sum = 0;
  int n = 0;
  for (const StepMean* step : group) {
    if (std::isnan(step->*member)) continue;
    sum += f(step->*member);
    ++n;
  }
  return n == 0 ? kNotMeasured : sum / n;
}

/// Welch-Satterthwaite, of the mean of the repetitions.
double freedom_of(const Group& group) {
  double squares = 0, share = 0;
  for (const StepMean* step : group) {
    const double square = step->thrust_u_n * step->thrust_u_n;
    squares += square;
    share += square * square / step->thrust_freedom;
  }
  return squares * squares / share;
}

StepMean average(const Group& group) {
  const double n = static_cast<double>(group.size());
  StepMean mean = *group.front();
  mean.repetition = 0;
  for (const auto member : kMeans) mean.*member = mean_over(group, member, std::identity());
  for (const auto member : kRootMeanSquares) mean.*member = std::sqrt(mean_over(group, member, square));
  for (const auto member : kUncertainties) mean.*member = std::sqrt(mean_over(group, member, square) / n);
  mean.thrust_freedom = freedom_of(group);
  mean.thrust_n_eff = 0;
  for (const auto member : kSums) mean.*member = 0;
  for (const StepMean* step : group) {
    mean.thrust_n_eff += step->thrust_n_eff;
    for (const auto member : kSums) mean.*member += step->*member;
    mean.quality_flags |= step->quality_flags;
  }
  return mean;
}

/// Steps of the same key, in the order of first appearance.
template <class Key>
std::vector<Group> groups_of(std::span<const StepMean> steps, Key key_of) {
  std::vector<Group> groups;
  std::map<std::invoke_result_t<Key, const StepMean&>, std::size_t> places;
  for (const StepMean& step : steps) {
    const auto [place, is_new] = places.try_emplace(key_of(step), groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&step);
  }
  return groups;
}

/// Standard uncertainty of the thrust at this speed, N: from the samples and from the uncertainty of the speed.
double u_within(const StepMean& step) {
  const double of_speed =
      std::isnan(step.speed_u_rad_s) ? 0 : 2 * step.thrust_n * step.speed_u_rad_s / step.speed_rad_s;
  return std::hypot(thrust_u_within(step), of_speed);
}

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
    variance += square(x * u_within(*step));
    zero.add(*step, x);
  }
  figure.k = tx / xx;
  figure.u = std::sqrt(variance + square(zero.u_n(movement.of_run_n(*run.front())) * x_sum)) / xx;
}

std::vector<RepetitionFigure> figures_of(const Runs& runs, const ZeroMovement& movement) {
  std::vector<RepetitionFigure> figures;
  std::optional<std::set<int>> common;
  for (const auto& [repetition, run] : runs) {
    const std::set<int> levels = good_levels(run);
    figures.push_back({.repetition = repetition, .usable = !levels.empty() && 2 * levels.size() >= run.size()});
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

/// χ² of the runs about the mean of their occlusion if the variance between runs were larger by `beyond`.
double chi_squared(std::span<const std::vector<RunShare>> occlusions, double beyond) {
  double sum = 0;
  for (const auto& runs : occlusions) {
    const double n = static_cast<double>(runs.size());
    if (n < 2) continue;
    double mean = 0, variances = 0;
    for (const RunShare& run : runs) {
      mean += run.k / n;
      variances += run.variance + beyond;
    }
    for (const RunShare& run : runs) {
      const double variance = (run.variance + beyond) * (1 - 2 / n) + variances / (n * n);
      sum += square(run.k - mean) / variance * (n - 1) / n;
    }
  }
  return sum;
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
  const double beyond = variance_between(others), n = static_cast<double>(others[o].size());
  double mean = 0, variance = run.variance + beyond;
  for (const RunShare& other : others[o]) {
    mean += other.k / n;
    variance += (other.variance + beyond) / (n * n);
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
      if (!std::isnan(figure.k)) shares.back().push_back({figure.k / verdict.k, square(figure.u / verdict.k)});
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
      verdict.reason = fmt::format("repetition {} has too few unflagged steps", figure.repetition);
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

struct Pair {
  const StepMean* up = nullptr;
  const StepMean* down = nullptr;
};

/// The profile's own way comes first, and it rises when its first step is not its fastest.
bool rises(std::span<const StepMean> run) {
  const auto first = std::ranges::min_element(run, {}, &StepMean::step);
  return std::ranges::any_of(
      run, [&](const StepMean& step) { return step.commanded_speed_rad_s > first->commanded_speed_rad_s; });
}

/// By commanded speed, of those that were held twice.
std::map<double, Pair> pairs_of(std::span<const StepMean> run) {
  std::map<double, std::vector<const StepMean*>> by_level;
  for (const StepMean& step : run) {
    if (is_good(step)) by_level[step.commanded_speed_rad_s].push_back(&step);
  }
  std::map<double, Pair> pairs;
  for (const auto& [level, steps] : by_level) {
    if (steps.size() != 2) continue;
    const bool in_order = (steps[0]->step < steps[1]->step) == rises(run);
    pairs[level] = in_order ? Pair{steps[0], steps[1]} : Pair{steps[1], steps[0]};
  }
  return pairs;
}

/// Of the air during a run, kg/m³; NaN: unknown.
double density_of(std::span<const StepMean> steps, int repetition) {
  const auto step = std::ranges::find(steps, repetition, &StepMean::repetition);
  return step != steps.end() ? step->air_density_kg_m3 : kNotMeasured;
}

}  // namespace

bool is_good(const StepMean& step) {
  return (step.quality_flags & ~kHarmlessFlags) == 0 && std::isfinite(step.thrust_n) && step.speed_rad_s > 0;
}

double thrust_u_within(const StepMean& step) {
  const double n = static_cast<double>(std::max<std::uint64_t>(step.thrust_samples, 1));
  if (std::isnan(step.thrust_u_n)) return step.thrust_sd_n / std::sqrt(n);
  return std::sqrt(std::max(square(step.thrust_u_n) - square(step.zero_u_n), 0.0));
}

std::vector<StepMean> means_of(std::span<const StepMean> steps) {
  std::vector<StepMean> means;
  const auto key = [](const StepMean& step) { return std::tuple(step.propeller, step.occlusion_deg, step.step); };
  for (const Group& group : groups_of(steps, key)) {
    Group good;
    std::ranges::copy_if(group, std::back_inserter(good), [](const StepMean* step) { return is_good(*step); });
    const bool chosen = !good.empty() && good.size() < group.size();
    means.push_back(average(chosen ? good : group));
    if (!chosen) continue;
    means.back().repetitions_averaged = static_cast<double>(good.size());
    means.back().repetitions_left_out = static_cast<double>(group.size() - good.size());
  }
  return means;
}

void ZeroMovement::add(const StepMean& step) {
  Range& range = of_run_[{step.propeller, step.occlusion_deg, step.repetition}];
  range.moved = step.zero_moved_n;
  range.lowest = std::fmin(range.lowest, step.zero_n);
  range.highest = std::fmax(range.highest, step.zero_n);
}

double ZeroMovement::Range::movement() const {
  return !std::isnan(moved) ? moved : highest > lowest ? highest - lowest : 0;
}

double ZeroMovement::usual_n() const {
  double squares = 0;
  for (const auto& [run, range] : of_run_) squares += square(range.movement()) / runs();
  return std::sqrt(squares);
}

double ZeroMovement::of_run_n(const StepMean& step) const {
  const auto own = of_run_.find({step.propeller, step.occlusion_deg, step.repetition});
  const double usual = usual_n();
  return own == of_run_.end() ? usual : std::hypot(usual, own->second.movement()) / std::sqrt(2.0);
}

void SharedZero::add(double zero_u_n, double begin_s, double end_s, double weight) {
  parts_.push_back({begin_s, end_s, weight});
  weights_ += weight;
  if (!std::isnan(zero_u_n)) measured_ += weight * zero_u_n;
}

double SharedZero::u_n(double movement_n) const {
  if (!(weights_ > 0)) return 0;
  const double begin = std::ranges::min(parts_, {}, &Part::begin_s).begin_s,
               end = std::ranges::max(parts_, {}, &Part::end_s).end_s;
  double covariance = 1.0 / 12;
  if (end > begin) {
    // Σ w w' min(s, s') over steps in the order of time, from the sums of those that are later.
    std::vector<std::pair<double, double>> sorted;
    for (const Part& part : parts_)
      sorted.emplace_back((0.5 * (part.begin_s + part.end_s) - begin) / (end - begin), part.weight / weights_);
    std::ranges::sort(sorted);
    double later = 1, least = 0, mean = 0;
    for (const auto& [share, weight] : sorted) {
      later -= weight;
      least += share * weight * (weight + 2 * later);
      mean += share * weight;
    }
    covariance = std::max(0.0, least - mean * mean);
  }
  return std::hypot(measured_ / weights_, movement_n * std::sqrt(covariance));
}

double freedom_between(std::span<const std::vector<RunShare>> occlusions) {
  double freedom = 0;
  for (const auto& runs : occlusions) freedom += runs.empty() ? 0 : static_cast<double>(runs.size() - 1);
  return freedom;
}

double variance_between(std::span<const std::vector<RunShare>> occlusions) {
  const double freedom = freedom_between(occlusions);
  double low = 0, high = 1e-12;
  if (chi_squared(occlusions, 1e-16) <= freedom) return 0;
  while (chi_squared(occlusions, high) > freedom) high *= 4;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (chi_squared(occlusions, middle) > freedom ? low : high) = middle;
  }
  return high;
}

double freedom_of(double variance_between, std::span<const std::vector<RunShare>> occlusions) {
  if (!(variance_between > 0)) return freedom_between(occlusions);
  double freedom = 0;
  for (const auto& runs : occlusions) {
    double explained = 0;
    for (const RunShare& run : runs) explained += run.variance / static_cast<double>(runs.size());
    if (runs.size() > 1)
      freedom += static_cast<double>(runs.size() - 1) * square(variance_between / (variance_between + explained));
  }
  return std::max(1.0, freedom);
}

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

std::string Hysteresis::to_words() const {
  const auto largest = std::ranges::max_element(speeds, {}, [](const auto& p) { return std::abs(p.up_minus_down_n); });
  const auto beyond = std::ranges::count_if(speeds, [](const auto& p) { return p.significant(); });
  return fmt::format(
      "thrust going up minus going down: {:+.3f} ± {:.3f} % of k{}; at most {:+.4f} ± {:.4f} N at {:.0f} RPM; {} of {} "
      "speeds beyond twice their uncertainty",
      100 * share, 100 * u_share, significant() ? "" : ", no hysteresis seen", largest->up_minus_down_n, largest->u_n,
      to_rpm(RadPerSec(largest->speed_rad_s)), beyond, speeds.size());
}

std::optional<Hysteresis> hysteresis_of(std::span<const StepMean> run) {
  Hysteresis found;
  double difference = 0, thrust = 0, weight = 0, variance = 0;
  for (const auto& [level, pair] : pairs_of(run)) {
    const double x = square(pair.up->speed_rad_s);
    const double scale = x / square(pair.down->speed_rad_s);
    const double down = pair.down->thrust_n * scale;
    const double u = std::hypot(u_within(*pair.up), scale * u_within(*pair.down));
    found.speeds.push_back({pair.up->speed_rad_s, pair.up->thrust_n - down, u});
    difference += x * found.speeds.back().up_minus_down_n;
    thrust += x * 0.5 * (pair.up->thrust_n + down);
    weight += x * x;
    variance += square(x * u);
  }
  if (found.speeds.size() < 2 || !(thrust > 0)) return std::nullopt;
  const double k = thrust / weight;
  found.share = difference / weight / k;
  found.u_share = std::sqrt(variance) / weight / k;
  return found;
}

bool ReferenceDrift::drifted() const { return std::abs(share) > std::max(2 * u_share, kReferenceDriftShare); }

std::string ReferenceDrift::to_words() const {
  return fmt::format("from the first to the last reference run k changed by {:+.3f} ± {:.3f} %{}{}", 100 * share,
                     100 * u_share, same_air ? " at equal air density" : "",
                     drifted() ? ": the bench has drifted; check propeller, mounting and load cell, and doubt the "
                                 "runs in between"
                               : "");
}

std::optional<ReferenceDrift> reference_drift(std::span<const StepMean> steps) {
  if (steps.empty()) return std::nullopt;
  const int first = -1, last = std::ranges::min(steps, {}, &StepMean::repetition).repetition;
  std::vector<StepMean> runs;
  std::ranges::copy_if(steps, std::back_inserter(runs),
                       [&](const StepMean& step) { return step.repetition == first || step.repetition == last; });
  const auto verdicts = judge_repetitions(runs);
  if (verdicts.size() != 1 || verdicts[0].repetitions.size() != 2) return std::nullopt;
  const RepetitionFigure &end = verdicts[0].repetitions[0], &begin = verdicts[0].repetitions[1];
  if (std::isnan(begin.k) || std::isnan(end.k) || !(begin.k > 0)) return std::nullopt;
  ReferenceDrift drift;
  drift.k_begin = begin.k;
  drift.k_end = end.k;
  const double thinning = density_of(runs, first) / density_of(runs, last);
  drift.same_air = std::isfinite(thinning);
  drift.share = end.k / begin.k * (drift.same_air ? thinning : 1) - 1;
  drift.u_share = std::hypot(begin.u / begin.k, end.u / end.k);
  return drift;
}

}  // namespace kphi::results
