#include "fit/model/power.hpp"

#include <cmath>
#include <map>
#include <utility>

namespace kphi::fit {

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
