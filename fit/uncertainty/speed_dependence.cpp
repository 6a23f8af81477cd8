#include "fit/uncertainty/speed_dependence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "base/error.hpp"
#include "base/statistics.hpp"
#include "fit/numerics/linear_regression.hpp"
#include "results/reduction/repetitions.hpp"

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
  std::map<int, double> zeros;
  for (const results::StepMean& step : steps) {
    double& zero_u = zeros[step.repetition];
    zero_u = std::fmax(zero_u, step.zero_u_n);  // ignores an unknown one
    if (!(step.speed_rad_s > 0)) continue;
    runs[step.repetition].samples.push_back(
        {step.step, step.speed_rad_s, step.speed_rad_s * step.speed_rad_s, step.thrust_n});
  }
  std::vector<Run> result;
  for (auto& [repetition, run] : runs) {
    double xt = 0, xx = 0;
    for (const Sample& sample : run.samples) xt += sample.x * sample.thrust, xx += sample.x * sample.x;
    run.k = xt / xx;
    if (const double u = results::shared_zero_u(zeros[repetition], zero_movement_n); u > 0) run.zero_u_n = u;
    std::ranges::sort(run.samples, {}, &Sample::level);
    result.push_back(std::move(run));
  }
  return result;
}

/// Variance of one step as a + b x², neither negative: the cell's noise and the air's.
struct NoiseModel {
  double constant = 1, growing = 0;
  [[nodiscard]] double at(double x) const { return constant + growing * x * x; }
};

/// From the variances of the levels at x.
NoiseModel noise_of(const std::vector<double>& x, const std::vector<double>& variances) {
  const double scale = *std::ranges::max_element(x);
  std::vector<double> squares;
  double mean = 0, share = 0, square_sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    squares.push_back(std::pow(x[i] / scale, 2));
    mean += variances[i] / static_cast<double>(x.size());
    share += variances[i] * squares[i];
    square_sum += squares[i] * squares[i];
  }
  NoiseModel model{mean, 0};
  try {
    const Regression line = regress_polynomial(squares, variances, 0, 1);
    if (line.estimates[0] > 0 && line.estimates[1] >= 0) {
      model = {line.estimates[0], line.estimates[1] / (scale * scale)};
    } else if (line.estimates[0] <= 0 && share > 0) {
      // All of it grows; a hundredth of the mean keeps the lowest levels from weighing without limit.
      model = {0.01 * mean, share / square_sum / (scale * scale)};
    }
  } catch (const FitError&) {
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
  std::vector<Run> runs;  ///< as measured
  RunModel model;
  std::vector<std::vector<double>>
      standardised;            ///< residuals of each run in its noise, complete levels, then the zero
  std::vector<double> trends;  ///< of each run, shares of k
  double trend_u = 0;          ///< of one run, as the noise has it
  double alone_freedom = 0;    ///< of a single run
};

double mean_x(const std::vector<Run>& runs, std::size_t i) {
  double sum = 0;
  for (const Run& run : runs) sum += run.samples[i].x / static_cast<double>(runs.size());
  return sum;
}

/// Noise from how the runs differ at each level, each about its own k and zero.
void take_noise(const std::vector<Run>& complete, RunModel& model) {
  std::vector<std::vector<double>> residuals;
  RunModel free;
  free.zero_is_free = true;
  for (const Run& run : complete) residuals.push_back(free.fit(run.samples, kNan).residuals);
  std::vector<double> x, variances;
  for (std::size_t i = 0; i < complete.front().samples.size(); ++i) {
    x.push_back(mean_x(complete, i));
    variances.push_back(variance(column(residuals, i)));
  }
  model.noise = noise_of(x, variances);
}

void take_residuals(const std::vector<Run>& complete, Angle& angle) {
  for (const Run& run : complete) {
    auto residuals = angle.model.fit(run.samples, run.zero_u_n).residuals;
    for (std::size_t i = 0; i < run.samples.size(); ++i)
      residuals[i] /= std::sqrt(angle.model.noise.at(mean_x(complete, i)));
    if (!angle.model.zero_is_free) residuals.back() /= run.zero_u_n;
    angle.standardised.push_back(std::move(residuals));
  }
}

void take_trends(Angle& angle, double slowest, double fastest, const Estimate& zero_movement) {
  RunModel model = angle.model;
  model.middle = 0.5 * (slowest + fastest);
  model.spread = fastest - slowest;
  model.k = 0;
  for (const Run& run : angle.runs) model.k += run.k / static_cast<double>(angle.runs.size());
  double squares = 0;
  for (const Run& run : angle.runs) {
    if (angle.runs.size() == 1) {  // its own residuals tell the noise
      RunModel free = model;
      free.zero_is_free = true;
      model.noise.constant = std::pow(free.fit(run.samples, kNan).residual_deviation, 2);
    }
    if (!(model.noise.at(run.samples.front().x) > 0)) return;
    const Regression found = model.fit(run.samples, run.zero_u_n);
    angle.trends.push_back(found.estimates.back());
    squares += found.covariance.back().back();
    angle.alone_freedom = static_cast<double>(found.freedom);
    if (model.zero_is_free || !(zero_movement.value > 0)) continue;
    const double wandering = variance_by_wandering(model, run.samples, found) * std::pow(zero_movement.value, 2);
    angle.alone_freedom = std::pow(squares + wandering, 2) /
                          (squares * squares / angle.alone_freedom + wandering * wandering / zero_movement.freedom);
    squares += wandering;
  }
  angle.trend_u = std::sqrt(squares / static_cast<double>(angle.runs.size()));
}

/// From the correlation of the residuals of neighbouring steps, after Box.
double independent_share(const std::vector<Angle>& angles) {
  std::vector<double> products;
  double n = 0, length = 0;
  for (const Angle& angle : angles) {
    if (angle.standardised.size() < 2) continue;
    const std::size_t levels = angle.standardised.front().size() - (angle.model.zero_is_free ? 0 : 1);
    products.resize(std::max(products.size(), levels / 2 + 1));
    std::vector<double> means;
    for (std::size_t i = 0; i < levels; ++i) means.push_back(mean(column(angle.standardised, i)));
    for (const auto& run : angle.standardised) {
      for (std::size_t lag = 0; lag <= levels / 2; ++lag)
        for (std::size_t i = 0; i + lag < levels; ++i)
          products[lag] += (run[i] - means[i]) * (run[i + lag] - means[i + lag]);
    }
    n += static_cast<double>(levels * (angle.standardised.size() - 1));
    length = std::max(length, static_cast<double>(levels));
  }
  double sum = 0;
  for (std::size_t lag = 1; lag < products.size(); ++lag) {
    const double rest = 1 - static_cast<double>(lag) / length;
    const double correlation = products[0] > 0 ? products[lag] / products[0] / rest : 0;
    sum += rest * (correlation * correlation - 1 / (n * rest));
  }
  return 1 / (1 + 2 * std::max(0.0, sum));
}

/// Of levels and zero, all with the k of their run taken out.
HypothesisTest test_levels(const Angle& angle, double share) {
  const double runs = static_cast<double>(angle.standardised.size());
  double between = 0, within = 0;
  for (std::size_t i = 0; i < angle.standardised.front().size(); ++i) {
    const auto values = column(angle.standardised, i);
    between += runs * std::pow(mean(values), 2);
    within += (runs - 1) * variance(values);
  }
  const double freedom = static_cast<double>(angle.standardised.front().size()) - (angle.model.zero_is_free ? 2 : 1);
  const double f = between / freedom / (within / (freedom * (runs - 1)));
  return f_test(f, share * freedom, share * freedom * (runs - 1));
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

std::vector<SpeedCoefficient> level_coefficients(const std::vector<Run>& runs) {
  std::map<int, std::vector<Point>> levels;
  for (const Run& run : runs)
    for (const Sample& sample : run.samples) levels[sample.level].push_back({sample.speed, sample.thrust, 1});
  std::vector<SpeedCoefficient> rows;
  for (const auto& [index, points] : levels) rows.push_back(k_at_speed(points));
  std::ranges::sort(rows, {}, &SpeedCoefficient::speed_rad_s);
  return rows;
}

Angle prepare(const SpeedDependence& found, std::vector<Run> runs, const std::vector<Run>& complete,
              const Estimate& zero_movement) {
  Angle angle;
  angle.model.zero_is_free = std::ranges::any_of(
      runs, [](double u) { return std::isnan(u); }, &Run::zero_u_n);
  angle.runs = std::move(runs);
  try {
    if (complete.size() > 1 && complete.front().samples.size() > 3) {
      take_noise(complete, angle.model);
      if (angle.model.noise.at(mean_x(complete, 0)) > 0) take_residuals(complete, angle);
    }
    take_trends(angle, found.levels.front().speed_rad_s, found.levels.back().speed_rad_s, zero_movement);
  } catch (const FitError&) {
    angle.trends.clear();
  }
  return angle;
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

void judge(const Angle& angle, const Estimate& scatter, double share, SpeedDependence& found) {
  const double runs = static_cast<double>(angle.trends.size());
  if (runs > 0) {
    const bool alone = scatter.freedom == 0;
    found.change = {mean(angle.trends), angle.trend_u * std::sqrt(scatter.value / runs),
                    alone ? angle.alone_freedom : scatter.freedom};
    found.trend = student_test(found.change, 0);
  }
  if (angle.standardised.size() > 1) found.lack_of_fit = test_levels(angle, share);
}

}  // namespace

std::vector<SpeedDependence> speed_dependence(std::span<const OcclusionCoefficient> table,
                                              const Estimate& zero_movement) {
  std::vector<SpeedDependence> result;
  std::vector<Angle> angles;
  std::vector<std::vector<Run>> complete;
  for (const OcclusionCoefficient& one : table) {
    std::vector<Run> runs = runs_of(one.measured, zero_movement.value);
    result.push_back({});
    result.back().phi_deg = one.phi_deg;
    result.back().levels = level_coefficients(runs);
    complete.push_back(complete_levels(runs));
    const bool testable = result.back().levels.size() > 2;
    angles.push_back(testable ? prepare(result.back(), std::move(runs), complete.back(), zero_movement) : Angle{});
  }
  const Estimate scatter = scatter_of_trends(angles);
  const double share = independent_share(angles);
  for (std::size_t i = 0; i < result.size(); ++i) {
    SpeedDependence& found = result[i];
    judge(angles[i], scatter, share, found);
    const bool untested = !found.lack_of_fit.tested() && found.levels.size() > 2;
    if ((untested || found.depends()) && !complete[i].front().samples.empty())
      found.inadequacy = inadequacy_of(complete[i]);
    found.lack_of_fit.statistic = "F";
    found.lack_of_fit.name = fmt::format("lack of fit of T = k w^2 at phi = {} deg", found.phi_deg);
    found.lack_of_fit.hypothesis = found.trend.hypothesis = "k does not depend on the speed";
    found.trend.name = fmt::format("trend of k with the speed at phi = {} deg", found.phi_deg);
  }
  return result;
}

}  // namespace kphi::fit
