#include "results/reduction/step_averages.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <string>
#include <tuple>
#include <utility>

#include "base/statistics.hpp"
#include "results/reduction/good_steps.hpp"

namespace kphi::results {

namespace {

using Group = StepGroup;

constexpr double StepMean::*kMeans[] = {
    // of every run
    &StepMean::commanded_speed_rad_s, &StepMean::thrust_n, &StepMean::torque_nm, &StepMean::zero_n,
    &StepMean::supply_voltage_v, &StepMean::supply_current_a, &StepMean::motor_current_a, &StepMean::window_begin_s,
    &StepMean::coil_temperature_degc, &StepMean::window_end_s,
    // of some
    &StepMean::supply_v, &StepMean::supply_a, &StepMean::supply_w, &StepMean::air_density_kg_m3,
    &StepMean::air_density_u_kg_m3, &StepMean::discarded_s, &StepMean::lag_s};
constexpr double StepMean::*kRootMeanSquares[] = {&StepMean::speed_rad_s, &StepMean::speed_sd_rad_s,
                                                  &StepMean::thrust_sd_n, &StepMean::torque_sd_nm,
                                                  &StepMean::zero_moved_n};
constexpr std::uint64_t StepMean::*kSums[] = {&StepMean::speed_n, &StepMean::thrust_samples, &StepMean::speed_glitches};
constexpr double StepMean::*kUncertainties[] = {&StepMean::thrust_u_n, &StepMean::speed_u_rad_s, &StepMean::zero_u_n,
                                                &StepMean::lag_u_s};

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

/// T = k ω² of one repetition of an occlusion, through the good steps.
class RunCoefficients {
 public:
  void add(const Group& good) {
    for (const StepMean* step : good) {
      Sums& run = of_occlusion_[{step->propeller, step->occlusion_deg}][step->repetition];
      const double x = square(step->speed_rad_s);
      run.xt += x * step->thrust_n;
      run.xx += x * x;
    }
  }

  /// Of k over the repetitions of the step's occlusion, as a share; NaN: fewer than two.
  [[nodiscard]] double scatter_share(const StepMean& step) const {
    const auto runs = of_occlusion_.find({step.propeller, step.occlusion_deg});
    if (runs == of_occlusion_.end() || runs->second.size() < 2) return kNotMeasured;
    std::vector<double> k;
    for (const auto& [repetition, sums] : runs->second) k.push_back(sums.xt / sums.xx);
    return std::sqrt(variance(k)) / std::abs(mean(k));
  }

  /// Of the thrust about the k of each repetition, N; NaN: fewer than two.
  [[nodiscard]] double thrust_scatter_n(const Group& good) const {
    if (good.size() < 2) return kNotMeasured;
    std::vector<double> residuals;
    for (const StepMean* step : good) {
      const Sums& run = of_occlusion_.at({step->propeller, step->occlusion_deg}).at(step->repetition);
      residuals.push_back(step->thrust_n - run.xt / run.xx * square(step->speed_rad_s));
    }
    return std::sqrt(variance(residuals));
  }

 private:
  struct Sums {
    double xt = 0, xx = 0;
  };
  std::map<std::pair<std::string, double>, std::map<int, Sums>> of_occlusion_;
};

}  // namespace

std::vector<StepMean> means_of(std::span<const StepMean> steps) {
  const auto key = [](const StepMean& step) { return std::tuple(step.propeller, step.occlusion_deg, step.step); };
  const std::vector<Group> groups = groups_of(steps, key);
  std::vector<Group> good(groups.size());
  RunCoefficients runs;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    std::ranges::copy_if(groups[i], std::back_inserter(good[i]), [](const StepMean* step) { return is_good(*step); });
    runs.add(good[i]);
  }
  std::vector<StepMean> means;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const Group& averaged = good[i].empty() ? groups[i] : good[i];
    StepMean mean = average(averaged);
    mean.repetitions_averaged = static_cast<double>(averaged.size());
    mean.repetitions_left_out = static_cast<double>(groups[i].size() - averaged.size());
    mean.k_scatter_share = runs.scatter_share(mean);
    mean.thrust_scatter_n = runs.thrust_scatter_n(good[i]);
    means.push_back(std::move(mean));
  }
  return means;
}

}  // namespace kphi::results
