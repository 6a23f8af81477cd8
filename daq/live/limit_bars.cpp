#include "daq/live/limit_bars.hpp"

#include <cmath>

namespace kphi::daq::live {

std::vector<LimitBar> limit_bars(const profiles::Limits& limits) {
  return {
      {"speed_rpm", "Speed", "RPM", to_rpm(limits.speed_max),
       [](const Observation& seen) { return to_rpm(seen.speed); }},
      {"thrust_n", "Thrust", "N", limits.thrust_max.value(),
       [](const Observation& seen) { return std::abs(seen.thrust.value()); }},
      {"supply_a", "Current", "A", limits.supply_current_max.value(),
       [](const Observation& seen) { return seen.supply_current.value(); }},
      {"coil_degc", "Coil", "°C", limits.coil_temperature_max.value(),
       [](const Observation& seen) { return seen.coil_temperature.value(); }},
  };
}

}  // namespace kphi::daq::live
