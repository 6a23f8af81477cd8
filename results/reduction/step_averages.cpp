#include "results/reduction/step_averages.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <tuple>

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
    &StepMean::air_density_u_kg_m3, &StepMean::discarded_s, &StepMean::zero_moved_n, &StepMean::lag_s};
constexpr double StepMean::*kRootMeanSquares[] = {&StepMean::speed_rad_s, &StepMean::speed_sd_rad_s,
                                                  &StepMean::thrust_sd_n, &StepMean::torque_sd_nm};
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

}  // namespace

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

}  // namespace kphi::results
