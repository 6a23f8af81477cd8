#include "fit/uncertainty/speed_dependence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>

#include "base/error.hpp"
#include "base/statistics.hpp"
#include "fit/numerics/linear_regression.hpp"
#include "results/reduction/run_zero.hpp"

namespace kphi::fit {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct Sample {
  int level = 0;
  double speed = 0, x = 0, thrust = 0;  ///< x = ω²
};

struct Run {
  std::vector<Sample> samples;  ///< in the order of their steps
  double k = 0;                 ///< through the origin
  double zero_u_n = kNan;       ///< of the zero that they share; NaN: not known
};

std::vector<Run> runs_of(std::span<const results::StepMean> steps, double zero_movement_n) {
  std::map<int, Run> runs;
  std::map<int, results::SharedZero> zeros;
  for (const results::StepMean& step : steps) {
    zeros[step.repetition].add(step, 1);
    if (!(step.speed_rad_s > 0)) continue;
    runs[step.repetition].samples.push_back(
        {step.step, step.speed_rad_s, step.speed_rad_s * step.speed_rad_s, step.thrust_n});
  }
  std::vector<Run> result;
  for (auto& [repetition, run] : runs) {
    double xt = 0, xx = 0;
    for (const Sample& sample : run.samples) xt += sample.x * sample.thrust, xx += sample.x * sample.x;
    run.k = xt / xx;
    if (const double u = zeros[repetition].u_n(zero_movement_n); u > 0) run.zero_u_n = u;
    std::ranges::sort(run.samples, {}, &Sample::level);
    result.push_back(std::move(run));
  }
  return result;
}

/// Variance of one step as a + b x², neither negative: the cell's noise and the air's. x may be the thrust as well.
struct NoiseModel {
  double constant = 1, growing = 0;
  [[nodiscard]] double at(double x) const { return constant + growing * x * x; }
};

/// From the variances of the levels at x, each of which scatters in proportion to itself: fitted with weights of the
/// last round, so that the quiet levels tell the constant.
NoiseModel noise_of(const std::vector<double>& x, const std::vector<double>& variances) {
  constexpr int kRounds = 5;
  const double scale = *std::ranges::max_element(x), average = mean(variances);
  std::vector<double> squares;
  for (const double one : x) squares.push_back(std::pow(one / scale, 2));
  NoiseModel model{average, 0};
  for (int round = 0; round < kRounds && average > 0; ++round) {
    std::vector<double> weights;
    for (const double one : x) weights.push_back(1 / std::pow(model.at(one), 2));
    try {
      const Regression line = regress_polynomial(squares, variances, 0, 1, weights);
      // A hundredth of the mean keeps the lowest levels from weighing without limit.
      model = {std::max(line.estimates[0], 0.01 * average), std::max(line.estimates[1], 0.0) / (scale * scale)};
    } catch (const FitError&) {
      break;
    }
  }
  return model;
}

/// T of one run on ω², its zero (with its uncertainty) and, with `spread`, k ω² (ω − middle)/spread.
struct RunModel {
  double middle = 0, spread = 0, k = 0;  ///< spread 0: without a trend
  NoiseModel noise;
  bool zero_is_free = false;

  [[nodiscard]] std::vector<double> row_of(const Sample& sample) const {
    return {sample.x, 1, k * sample.x * (sample.speed - middle) / spread};
  }
  /// The trend is the last term. The last residual is that of the zero if its uncertainty is known.
  [[nodiscard]] Regression fit(const std::vector<Sample>& samples, double zero_u_n) const {
    std::vector<std::vector<double>> rows;
    std::vector<double> thrusts, weights;
    const auto add = [&](std::vector<double> row, double thrust, double variance) {
      row.resize(spread > 0 ? 3 : 2);
      rows.push_back(std::move(row));
      thrusts.push_back(thrust);
      weights.push_back(1 / variance);
    };
    for (const Sample& sample : samples) add(row_of(sample), sample.thrust, noise.at(sample.x));
    if (!zero_is_free) add({0, 1, 0}, 0, zero_u_n * zero_u_n);
    if (rows.size() <= (spread > 0 ? 3 : 2)) throw FitError("k against speed: too few steps in a run");
    return regress(rows, thrusts, weights);
  }
};

/// Variance that a zero wandering within the run adds to its trend; a movement of 1 N is usual. About its mean, which
/// counts as the zero's own error, a random walk tied at both ends has the covariance 1/12 − d/2 + d²/2, d the time
/// between two steps as a share of the run (Watson, Biometrika 48 (1961) 109).
double variance_by_wandering(const RunModel& model, const std::vector<Sample>& samples, const Regression& found) {
  std::vector<double> influence;  // of the thrust of each step on the trend
  for (const Sample& sample : samples) {
    const std::vector<double> row = model.row_of(sample);
    const auto& covariance = found.covariance.back();
    influence.push_back(std::inner_product(row.begin(), row.end(), covariance.begin(), 0.0) / model.noise.at(sample.x));
  }
  double sum = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = 0; j < samples.size(); ++j) {
      const double apart =
          std::abs(static_cast<double>(i) - static_cast<double>(j)) / static_cast<double>(samples.size());
      sum += influence[i] * influence[j] * (1.0 / 12 - apart / 2 + apart * apart / 2);
    }
  }
  return std::max(0.0, sum);
}

/// The levels that all runs measured, one column each.
std::vector<Run> complete_levels(std::vector<Run> runs) {
  std::map<int, std::size_t> counts;
  for (const Run& run : runs)
    for (const Sample& sample : run.samples) ++counts[sample.level];
  for (Run& run : runs)
    std::erase_if(run.samples, [&](const Sample& sample) { return counts[sample.level] < runs.size(); });
  return runs;
}

/// Values of all runs at one place.
std::vector<double> column(const std::vector<std::vector<double>>& runs, std::size_t i) {
  std::vector<double> values;
  for (const auto& run : runs) values.push_back(run[i]);
  return values;
}

/// The runs at one φ, prepared for the tests.
struct Angle {
  double k = 0;               ///< mean over the runs
  std::vector<Run> runs;      ///< as measured
  std::vector<Run> complete;  ///< the levels that all of them measured
  RunModel model;
  std::vector<std::vector<double>>
      standardised;            ///< residuals of each run in its noise, complete levels, then the zero
  std::vector<double> trends;  ///< of each run, shares of k
  double trend_u = 0;          ///< of one run, as the noise has it
  double wandering_share = 0;  ///< of trend_u²
  double alone_freedom = 0;    ///< of the noise in a single run

  [[nodiscard]] bool comparable() const { return complete.size() > 1 && complete.front().samples.size() > 3; }
};

double mean_x(const std::vector<Run>& runs, std::size_t i) {
  double sum = 0;
  for (const Run& run : runs) sum += run.samples[i].x / static_cast<double>(runs.size());
  return sum;
}

/// By the thrust, from how the runs of each φ differ at each level, each about its own k and zero; of all φ together,
/// since one alone would fit its own differences too well to be their measure.
NoiseModel noise_of(const std::vector<Angle>& angles) {
  std::vector<double> thrusts, variances;
  for (const Angle& angle : angles) {
    if (!angle.comparable()) continue;
    std::vector<std::vector<double>> residuals;
    RunModel free;
    free.zero_is_free = true;
    for (const Run& run : angle.complete) residuals.push_back(free.fit(run.samples, kNan).residuals);
    for (std::size_t i = 0; i < angle.complete.front().samples.size(); ++i) {
      thrusts.push_back(angle.k * mean_x(angle.complete, i));
      variances.push_back(variance(column(residuals, i)));
    }
  }
  return thrusts.empty() ? NoiseModel{} : noise_of(thrusts, variances);
}

void take_residuals(Angle& angle) {
  for (const Run& run : angle.complete) {
    auto residuals = angle.model.fit(run.samples, run.zero_u_n).residuals;
    for (std::size_t i = 0; i < run.samples.size(); ++i)
      residuals[i] /= std::sqrt(angle.model.noise.at(mean_x(angle.complete, i)));
    if (!angle.model.zero_is_free) residuals.back() /= run.zero_u_n;
    angle.standardised.push_back(std::move(residuals));
  }
}

void take_trends(Angle& angle, double slowest, double fastest, const Estimate& zero_movement) {
  RunModel model = angle.model;
  model.middle = 0.5 * (slowest + fastest);
  model.spread = fastest - slowest;
  model.k = angle.k;
  double noise = 0, wandering = 0;
  for (const Run& run : angle.runs) {
    if (angle.runs.size() == 1) {  // its own residuals tell the noise
      RunModel free = model;
      free.zero_is_free = true;
      model.noise.constant = std::pow(free.fit(run.samples, kNan).residual_deviation, 2);
    }
    if (!(model.noise.at(run.samples.front().x) > 0)) return;
    const Regression found = model.fit(run.samples, run.zero_u_n);
    angle.trends.push_back(found.estimates.back());
    noise += found.covariance.back().back();
    angle.alone_freedom = static_cast<double>(found.freedom);
    if (!model.zero_is_free && zero_movement.value > 0)
      wandering += variance_by_wandering(model, run.samples, found) * std::pow(zero_movement.value, 2);
  }
  angle.trend_u = std::sqrt((noise + wandering) / static_cast<double>(angle.runs.size()));
  angle.wandering_share = wandering / (noise + wandering);
}

/// Differences between the runs of one φ, orthonormal (Helmert): each has the covariance of one run, and none of what
/// the runs share.
std::vector<std::vector<double>> contrasts_of(const Angle& angle) {
  std::vector<std::vector<double>> contrasts;
  for (std::size_t j = 1; j < angle.standardised.size(); ++j) {
    const double n = static_cast<double>(j);
    std::vector<double> contrast(angle.standardised.front().size());
    for (std::size_t i = 0; i < contrast.size(); ++i) {
      for (std::size_t run = 0; run < j; ++run) contrast[i] += angle.standardised[run][i];
      contrast[i] = (contrast[i] - n * angle.standardised[j][i]) / std::sqrt(n * (n + 1));
    }
    contrasts.push_back(std::move(contrast));
  }
  return contrasts;
}

/// Degrees of freedom of the residuals of one run, (tr C)²/tr C² of their covariance C (Box). Two independent contrasts
/// u and v tell tr C = E u·u and tr C² = E (u·v)², whatever C is; pooled over all φ. Few pairs tell tr C² badly, and
/// too much freedom finds what is not there: it is taken one standard error larger. 1 if there are no two.
double freedom_of_residuals(const std::vector<Angle>& angles) {
  std::vector<std::vector<double>> all;
  for (const Angle& angle : angles) std::ranges::move(contrasts_of(angle), std::back_inserter(all));
  const auto product = [](const auto& u, const auto& v) {
    return std::inner_product(u.begin(), u.end(), v.begin(), 0.0);
  };
  double trace = 0;
  std::vector<double> squares;
  for (std::size_t i = 0; i < all.size(); ++i) {
    trace += product(all[i], all[i]) / static_cast<double>(all.size());
    for (std::size_t j = 0; j < i; ++j) {
      if (all[i].size() != all[j].size()) continue;
      squares.push_back(std::pow(product(all[i], all[j]), 2));
    }
  }
  if (squares.size() < 2) return 1;
  const double error = std::sqrt(variance(squares) / static_cast<double>(squares.size()));
  return std::max(1.0, trace * trace / (mean(squares) + error));
}

/// Of levels and zero, all with the k of their run taken out.
HypothesisTest test_levels(const Angle& angle, double freedom) {
  const double runs = static_cast<double>(angle.standardised.size());
  double between = 0, within = 0;
  for (std::size_t i = 0; i < angle.standardised.front().size(); ++i) {
    const auto values = column(angle.standardised, i);
    between += runs * std::pow(mean(values), 2);
    within += (runs - 1) * variance(values);
  }
  return f_test(between / within * (runs - 1), freedom, freedom * (runs - 1));
}

/// Rms of the levels' deviation about k ω² without a zero, less what noise makes of it.
double inadequacy_of(const std::vector<Run>& complete) {
  double excess = 0, xx = 0;
  for (std::size_t i = 0; i < complete.front().samples.size(); ++i) {
    std::vector<double> residuals;
    for (const Run& run : complete) residuals.push_back(run.samples[i].thrust - run.k * run.samples[i].x);
    const double noise = complete.size() > 1 ? variance(residuals) / static_cast<double>(complete.size()) : 0;
    excess += std::pow(mean(residuals), 2) - noise;
    xx += std::pow(mean_x(complete, i), 2);
  }
  const double n = static_cast<double>(complete.front().samples.size());
  return std::sqrt(std::max(0.0, excess / xx * (complete.size() > 1 ? 1 : n / (n - 1))));
}

/// Rms of the trend's line about the k of the runs, every speed from the slowest to the fastest as likely. The k of a
/// run weighs its steps in ω⁴, so that it belongs to a high speed, and a slow rotor is far from it.
double spread_of_trend(const Angle& angle, double slowest, double fastest, double change) {
  double offset = 0, xx = 0;  // of that speed from the middle, as a share of the range
  for (const Run& run : angle.runs) {
    for (const Sample& sample : run.samples) {
      offset += sample.x * sample.x * ((sample.speed - slowest) / (fastest - slowest) - 0.5);
      xx += sample.x * sample.x;
    }
  }
  return std::abs(change) * angle.k * std::sqrt(1.0 / 12 + std::pow(offset / xx, 2));
}

std::vector<SpeedCoefficient> level_coefficients(const std::vector<Run>& runs) {
  std::map<int, std::vector<Point>> levels;
  for (const Run& run : runs)
    for (const Sample& sample : run.samples) levels[sample.level].push_back({sample.speed, sample.thrust, 1});
  std::vector<SpeedCoefficient> rows;
  for (const auto& [index, points] : levels) rows.push_back(k_at_speed(points));
  std::ranges::sort(rows, {}, &SpeedCoefficient::speed_rad_s);
  return rows;
}

Angle angle_of(std::vector<Run> runs) {
  Angle angle;
  angle.model.zero_is_free = std::ranges::any_of(
      runs, [](double u) { return std::isnan(u); }, &Run::zero_u_n);
  for (const Run& run : runs) angle.k += run.k / static_cast<double>(runs.size());
  angle.complete = complete_levels(runs);
  angle.runs = std::move(runs);
  return angle;
}

void prepare(const SpeedDependence& found, const NoiseModel& noise, const Estimate& zero_movement, Angle& angle) {
  try {
    angle.model.noise = {noise.constant, noise.growing * angle.k * angle.k};
    if (angle.comparable() && angle.model.noise.at(mean_x(angle.complete, 0)) > 0) take_residuals(angle);
    take_trends(angle, found.levels.front().speed_rad_s, found.levels.back().speed_rad_s, zero_movement);
  } catch (const FitError&) {
    angle.trends.clear();
  }
}

/// Variance of the trends from run to run over the variance that the noise explains; its freedom.
Estimate scatter_of_trends(const std::vector<Angle>& angles) {
  double squares = 0, freedom = 0;
  for (const Angle& angle : angles) {
    if (angle.trends.size() < 2 || !(angle.trend_u > 0)) continue;
    const double more = static_cast<double>(angle.trends.size() - 1);
    squares += more * variance(angle.trends) / (angle.trend_u * angle.trend_u);
    freedom += more;
  }
  return {freedom > 0 ? squares / freedom : 1, 0, freedom};
}

void judge(const Angle& angle, const Estimate& scatter, const Estimate& zero_movement, double freedom,
           SpeedDependence& found) {
  const double runs = static_cast<double>(angle.trends.size());
  if (runs > 0) {
    const double of_scatter =
        scatter.freedom > 0 ? 1 / scatter.freedom : std::pow(1 - angle.wandering_share, 2) / angle.alone_freedom;
    const double of_zero = std::pow(angle.wandering_share, 2) / zero_movement.freedom;
    found.change = {mean(angle.trends), angle.trend_u * std::sqrt(scatter.value / runs), 1 / (of_scatter + of_zero)};
    found.trend = student_test(found.change, 0);
  }
  if (angle.standardised.size() > 1) found.lack_of_fit = test_levels(angle, freedom);
}

}  // namespace

std::vector<SpeedDependence> speed_dependence(std::span<const OcclusionCoefficient> table,
                                              const Estimate& zero_movement) {
  std::vector<SpeedDependence> result;
  std::vector<Angle> angles;
  for (const OcclusionCoefficient& one : table) {
    angles.push_back(angle_of(runs_of(one.measured, zero_movement.value)));
    result.emplace_back().phi_deg = one.phi_deg;
    result.back().levels = level_coefficients(angles.back().runs);
  }
  const NoiseModel noise = noise_of(angles);
  for (std::size_t i = 0; i < result.size(); ++i)
    if (result[i].levels.size() > 2) prepare(result[i], noise, zero_movement, angles[i]);
  const Estimate scatter = scatter_of_trends(angles);
  const double freedom = freedom_of_residuals(angles);
  for (std::size_t i = 0; i < result.size(); ++i) {
    SpeedDependence& found = result[i];
    judge(angles[i], scatter, zero_movement, freedom, found);
    if (found.depends() && !angles[i].complete.front().samples.empty())
      found.inadequacy = inadequacy_of(angles[i].complete);
    if (found.trend.p < kTestLevel / 2)
      found.inadequacy =
          std::max(found.inadequacy, spread_of_trend(angles[i], found.levels.front().speed_rad_s,
                                                     found.levels.back().speed_rad_s, found.change.value));
    found.lack_of_fit.statistic = "F";
    found.lack_of_fit.name = fmt::format("lack of fit of T = k w^2 at phi = {} deg", found.phi_deg);
    found.lack_of_fit.hypothesis = found.trend.hypothesis = "k does not depend on the speed";
    found.trend.name = fmt::format("trend of k with the speed at phi = {} deg", found.phi_deg);
  }
  return result;
}

}  // namespace kphi::fit
