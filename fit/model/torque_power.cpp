#include "fit/model/torque_power.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "base/error.hpp"

namespace kphi::fit {
namespace {

/// Steps with the torque in place of the thrust, N m for N, positive: its sign is only the direction of rotation. Of
/// the zero of the torque nothing is known.
std::vector<results::StepMean> torque_steps(std::span<const results::StepMean> steps) {
  double sum = 0;
  for (const results::StepMean& step : steps) sum += step.torque_nm;
  std::vector<results::StepMean> result;
  if (!std::isfinite(sum) || sum == 0) return result;
  for (results::StepMean step : steps) {
    step.thrust_n = std::copysign(1.0, sum) * step.torque_nm;
    step.thrust_sd_n = step.torque_sd_nm;
    step.thrust_u_n = step.torque_sd_nm / std::sqrt(step.thrust_n_eff);
    step.zero_n = step.zero_u_n = step.zero_moved_n = std::numeric_limits<double>::quiet_NaN();
    step.k_scatter_share = step.thrust_scatter_n = std::numeric_limits<double>::quiet_NaN();
    result.push_back(std::move(step));
  }
  return result;
}

}  // namespace

std::optional<TorqueFit> fit_torque(std::span<const results::StepMean> steps, const IdentificationOptions& options) {
  const std::vector<results::StepMean> torques = torque_steps(steps);
  if (torques.empty()) return std::nullopt;
  TorqueFit fitted;
  try {
    fitted.table = coefficients_of(torques, {.mounting = options.mounting, .mounted_once = options.mounted_once}, 0,
                                   fitted.repeatability);
  } catch (const FitError&) {
    return std::nullopt;
  }
  return fitted.table.front().k > 0 ? std::optional(std::move(fitted)) : std::nullopt;
}

std::vector<StepPower> power_of(std::span<const results::StepMean> steps) {
  std::map<std::pair<double, int>, std::vector<StepPower>> groups;
  for (const results::StepMean& step : steps) {
    const bool by_supply = !std::isnan(step.supply_w);
    const double watts = by_supply ? step.supply_w : step.supply_voltage_v * step.supply_current_a;
    if (!(watts > 0)) continue;
    groups[{step.occlusion_deg, step.step}].push_back(
        {step.occlusion_deg, step.step, step.speed_rad_s, step.thrust_n, watts, by_supply});
  }
  std::vector<StepPower> rows;
  for (const auto& [key, group] : groups) {
    StepPower mean{key.first, key.second, 0, 0, 0, true};
    const double n = static_cast<double>(group.size());
    for (const StepPower& one : group) {
      mean.speed_rad_s += one.speed_rad_s / n;
      mean.thrust_n += one.thrust_n / n;
      mean.power_w += one.power_w / n;
      mean.by_supply = mean.by_supply && one.by_supply;
    }
    rows.push_back(mean);
  }
  return rows;
}

}  // namespace kphi::fit
