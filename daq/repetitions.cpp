#include "daq/repetitions.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <tuple>

namespace kphi::daq {
namespace {

using results::StepMean;
using Group = std::vector<const StepMean*>;

constexpr double StepMean::*kMeans[] = {
    &StepMean::commanded_speed_rad_s,
    &StepMean::thrust_n,
    &StepMean::torque_nm,
    &StepMean::zero_n,
    &StepMean::supply_voltage_v,
    &StepMean::supply_current_a,
    &StepMean::motor_current_a,
    &StepMean::window_begin_s,
    &StepMean::coil_temperature_degc,
    &StepMean::window_end_s,
    &StepMean::supply_v,
    &StepMean::supply_a,
    &StepMean::supply_w,
    &StepMean::air_density_kg_m3,
    &StepMean::air_density_u_kg_m3,
};
constexpr double StepMean::*kRootMeanSquares[] = {&StepMean::speed_rad_s, &StepMean::speed_sd_rad_s,
                                                  &StepMean::thrust_sd_n, &StepMean::torque_sd_nm};

/// Mean of f(value) over the rows that have the value; NaN without any.
template <class Function>
double mean_over(const Group& group, double StepMean::*member, Function f) {
  double sum = 0;
  int n = 0;
  for (const StepMean* step : group) {
    if (std::isnan(step->*member)) continue;
    sum += f(step->*member);
    ++n;
  }
  return n == 0 ? std::numeric_limits<double>::quiet_NaN() : sum / n;
}

StepMean average(const Group& group) {
  StepMean mean = *group.front();
  mean.repetition = 0;
  for (const auto member : kMeans) mean.*member = mean_over(group, member, [](double x) { return x; });
  for (const auto member : kRootMeanSquares) {
    mean.*member = std::sqrt(mean_over(group, member, [](double x) { return x * x; }));
  }
  mean.speed_n = 0;
  mean.thrust_samples = 0;
  for (const StepMean* step : group) {
    mean.speed_n += step->speed_n;
    mean.thrust_samples += step->thrust_samples;
    mean.doubts |= step->doubts;
  }
  return mean;
}

}  // namespace

std::vector<StepMean> average_repetitions(std::span<const StepMean> steps) {
  std::vector<Group> groups;
  std::map<std::tuple<std::string, double, int>, std::size_t> places;
  for (const StepMean& step : steps) {
    const auto [place, is_new] = places.try_emplace({step.propeller, step.occlusion_deg, step.step}, groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&step);
  }
  std::vector<StepMean> means;
  for (const Group& group : groups) means.push_back(average(group));
  return means;
}

}  // namespace kphi::daq
