#include "daq/supply_interlock.hpp"

#include <fmt/format.h>

#include <cmath>

namespace kphi::daq {
namespace {

constexpr double kSetting = 0.011;  // V and A: the coarsest step of a supply, and rounding

std::optional<Trip> moved(const char* what, double now, double wanted, const char* unit) {
  if (std::abs(now - wanted) <= kSetting) return std::nullopt;
  return Trip{fmt::format("supply: its {} is {:g} {} where {:g} {} was set: somebody has turned a knob", what, now,
                          unit, wanted, unit)};
}

}  // namespace

std::string tripped_words(const results::SupplyReading& seen) {
  return fmt::format("supply: its {} protection has switched it off", name_of(seen.protection));
}

std::optional<Trip> check(const results::SupplyReading& seen, const profiles::SupplyPlace& wanted, bool settled) {
  const double volts = wanted.voltage.value();
  const bool limits = seen.regulation == results::SupplyRegulation::constant_current;
  if (seen.protection != results::SupplyProtection::none) return Trip{tripped_words(seen)};
  if (seen.output == 0) return Trip{"supply: its output is off"};
  if (limits && settled)
    return Trip{fmt::format("supply: it limits the current: {:.3g} A at {:.4g} V", seen.current_a, seen.voltage_v)};
  if (auto trip = moved("set voltage", seen.set_voltage_v, volts, "V")) return trip;
  if (auto trip = moved("current limit", seen.current_limit_a, wanted.current_limit.value(), "A")) return trip;
  if (!settled) return std::nullopt;
  // Written so that NaN trips.
  if (!(seen.voltage_v >= (1 - kSupplySag) * volts))
    return Trip{fmt::format("supply: {:.4g} V at its terminals, more than {:g} % below the {:g} V set", seen.voltage_v,
                            100 * kSupplySag, volts)};
  if (seen.voltage_v > (1 + kSupplyRise) * volts)
    return Trip{
        fmt::format("supply: {:.4g} V at its terminals, more than {:g} % above the {:g} V set: the motor feeds back",
                    seen.voltage_v, 100 * kSupplyRise, volts)};
  return std::nullopt;
}

}  // namespace kphi::daq
