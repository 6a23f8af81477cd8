#include "fit/signal/dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "base/error.hpp"
#include "fit/numerics/least_squares.hpp"
#include "results/reduction/reduction.hpp"

namespace kphi::fit {
namespace {

using results::Transition;

constexpr double kBefore = 0.15;   // s before the command whose mean is the old speed
constexpr double kSettled = 0.5;   // share of a step after which its readings are the new speed
constexpr double kStandstill = 5;  // rad/s
constexpr double kLeastChange = 0.01;

struct NormalisedReading {
  double t = 0;  // since the command
  double y = 0;  // 0: old speed, 1: new one
  double weight = 0;
};

/// Mean speed of the readings in [begin, end), s since the command; NaN without any.
double mean_speed(const Transition& step, double begin, double end) {
  double sum = 0, n = 0;
  for (const results::SquaredSpeed& reading : step.squared) {
    if (reading.time_s < begin || reading.time_s >= end) continue;
    sum += std::sqrt(reading.value);
    ++n;
  }
  return sum / n;
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

/// Starts from the mean residence time, the sum of delay and time constant.
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
  std::size_t steps = 0;
};

void collect(const Transition& step, Collected& all) {
  const double end = static_cast<double>(step.thrust.size()) * step.bin_s;
  const double before = mean_speed(step, -kBefore, 0), after = mean_speed(step, kSettled * end, end);
  const double change = after - before;
  if (step.ramped || !(before > kStandstill) || !(std::abs(change) >= kLeastChange * before)) return;
  const double weight = change * change;
  double passed = 0, missing = 1;
  for (const auto& [time, squared] : step.squared) {
    if (time < 0) continue;
    const double y = (std::sqrt(squared) - before) / change;
    all.readings.push_back({time, y, std::abs(change)});
    all.residence += weight * 0.5 * (missing + 1 - y) * (time - passed);
    passed = time;
    missing = 1 - y;
  }
  all.residence_weight += weight;
  ++all.steps;
}

}  // namespace

std::optional<Dynamics> identify_dynamics(std::span<const results::RunRecording> runs) {
  std::vector<Transition> transitions;
  for (const results::RunRecording& run : runs)
    for (Transition& step : results::transitions_of(run)) transitions.push_back(std::move(step));
  Collected all;
  for (const Transition& step : transitions) collect(step, all);
  if (all.steps < 3 || all.readings.size() < 10) return std::nullopt;
  Dynamics dynamics;
  dynamics.steps = all.steps;
  const results::Lag lag = results::estimate_lag(transitions);
  dynamics.thrust_lag_s = {lag.known() ? lag.seconds : std::nan(""), lag.u, lag.freedom};
  try {
    fit_motor(all.readings, std::max(1e-3, all.residence / all.residence_weight), dynamics);
  } catch (const FitError&) {
    return std::nullopt;
  }
  return dynamics;
}

}  // namespace kphi::fit
