#include "fit/signal/dynamics.hpp"

#include <algorithm>
#include <cmath>

#include "base/error.hpp"
#include "fit/numerics/least_squares.hpp"
#include "fit/signal/step_clock.hpp"

namespace kphi::fit {
namespace {

constexpr double kBefore = 0.15;  // s before the command whose mean is the old state
constexpr double kSettled = 0.5;  // share of a step after which its new state is taken

struct NormalisedReading {
  double t = 0;  // since the command
  double y = 0;  // 0: old speed, 1: new one
  double weight = 0;
};

double mean_of(const std::vector<TimedSample>& samples, double begin, double end) {
  double sum = 0, n = 0;
  for (const TimedSample& sample : samples) {
    if (sample.t_s < begin || sample.t_s >= end) continue;
    sum += sample.value;
    ++n;
  }
  return sum / n;  // NaN when there is none
}

/// ∫ value dt by trapezoids, held constant beyond the ends. Until `begin` nothing has moved: the trapezoid across it
/// starts at the sample before, or the rise would be counted from where nobody looked.
double integral(const std::vector<TimedSample>& samples, double begin, double end) {
  double sum = 0, t = begin, value = samples.front().value, before = 0;
  for (const TimedSample& sample : samples) {
    if (sample.t_s >= end) break;
    if (sample.t_s > begin) {
      sum += 0.5 * (value + sample.value) * (sample.t_s - t);
    } else {
      before = sample.value * (begin - sample.t_s);
    }
    t = sample.t_s;
    value = sample.value;
  }
  return sum - before + value * (end - t);
}

std::vector<TimedSample> samples_of(const EvenSamples& even) {
  std::vector<TimedSample> samples;
  for (std::size_t i = 0; i < even.values.size(); ++i)
    samples.push_back({even.begin_s + static_cast<double>(i) / even.rate_hz, even.values[i]});
  return samples;
}

struct Exponential {
  NormalisedReading reading;
  template <class Scalar>
  bool operator()(const Scalar* time_constant, const Scalar* delay, Scalar* residual) const {
    using std::exp;
    const Scalar since = reading.t - *delay;
    const Scalar y = since > Scalar(0) ? Scalar(1) - exp(-since / *time_constant) : Scalar(0);
    residual[0] = reading.weight * (reading.y - y);
    return true;
  }
};

/// The mean residence time, delay and time constant together, is a safe start.
void fit_motor(const std::vector<NormalisedReading>& readings, double residence, Dynamics& dynamics) {
  double time_constant = 0.7 * residence, delay = 0.3 * residence;
  ceres::Problem problem(problem_options());
  for (const NormalisedReading& reading : readings) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Exponential, 1, 1, 1>(new Exponential{reading}), nullptr,
                             &time_constant, &delay);
  }
  problem.SetParameterLowerBound(&time_constant, 0, 1e-6);
  solve_robustly(problem, "time constant");
  double cost = 0;
  problem.Evaluate({}, &cost, nullptr, nullptr, nullptr);
  const double freedom = static_cast<double>(readings.size()) - 2;
  const auto covariance = unit_covariance(problem, {&time_constant, &delay}, "time constant");
  dynamics.motor_time_constant_s = {time_constant, std::sqrt(covariance[0] * 2 * cost / freedom), freedom};
  dynamics.motor_delay_s = {delay, std::sqrt(covariance[3] * 2 * cost / freedom), freedom};
}

struct Collected {
  std::vector<NormalisedReading> readings;
  double residence = 0, residence_weight = 0;
};

/// Leaves a step out that cannot tell anything.
void respond(const results::RunRecording& run, const StepSpan& span, double least_change, Dynamics& dynamics,
             Collected& all) {
  if (std::abs(span.commanded_rad_s - span.previous_rad_s) < least_change * span.previous_rad_s) return;
  if (!(span.previous_rad_s > 0)) return;
  const double begin = span.begin_s, end = span.end_s, settled = begin + kSettled * (end - begin);
  const auto speeds = speeds_between(run, begin - kBefore, end);
  const auto thrusts = samples_of(thrust_between(run, begin - kBefore, end));
  const double old_speed = mean_of(speeds, begin - kBefore, begin), new_speed = mean_of(speeds, settled, end);
  const double old_thrust = mean_of(thrusts, begin - kBefore, begin), new_thrust = mean_of(thrusts, settled, end);
  const double change = new_speed - old_speed, thrust_change = new_thrust - old_thrust;
  if (!std::isfinite(change * thrust_change) || change == 0 || thrust_change == 0) return;

  std::vector<TimedSample> squares = speeds;
  for (TimedSample& sample : squares) sample.value *= sample.value;
  const double old_square = mean_of(squares, begin - kBefore, begin), new_square = mean_of(squares, settled, end);
  const double expected = (integral(squares, begin, end) - old_square * (end - begin)) / (new_square - old_square);
  const double found = (integral(thrusts, begin, end) - old_thrust * (end - begin)) / thrust_change;
  dynamics.steps.push_back({span.step, old_speed, new_speed, old_thrust, new_thrust, expected - found});

  for (const TimedSample& sample : speeds) {
    if (sample.t_s >= begin)
      all.readings.push_back({sample.t_s - begin, (sample.value - old_speed) / change, std::abs(change)});
  }
  all.residence +=
      change * change * (end - begin - (integral(speeds, begin, end) - old_speed * (end - begin)) / change);
  all.residence_weight += change * change;
}

Estimate weighted_lag(const std::vector<StepResponse>& steps) {
  double sum = 0, weights = 0, squares = 0, weight_squares = 0;
  for (const StepResponse& step : steps) {
    const double weight = std::pow(step.to_n - step.from_n, 2);
    sum += weight * step.thrust_lag_s;
    weights += weight;
    weight_squares += weight * weight;
  }
  const double mean = sum / weights;
  for (const StepResponse& step : steps)
    squares += std::pow(std::pow(step.to_n - step.from_n, 2) * (step.thrust_lag_s - mean), 2);
  const double freedom = std::max(1.0, weights * weights / weight_squares - 1);
  return {mean, std::sqrt(squares * (freedom + 1) / freedom) / weights, freedom};
}

}  // namespace

std::optional<Dynamics> identify_dynamics(std::span<const results::RunRecording> runs, double least_change) {
  Dynamics dynamics;
  Collected all;
  for (const results::RunRecording& run : runs) {
    for (const StepSpan& span : step_spans(run)) respond(run, span, least_change, dynamics, all);
  }
  if (dynamics.steps.size() < 3 || all.readings.size() < 10) return std::nullopt;
  dynamics.thrust_lag_s = weighted_lag(dynamics.steps);
  try {
    fit_motor(all.readings, std::max(1e-3, all.residence / all.residence_weight), dynamics);
  } catch (const FitError&) {
    return std::nullopt;
  }
  return dynamics;
}

}  // namespace kphi::fit
