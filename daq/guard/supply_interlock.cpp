#include "daq/guard/supply_interlock.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace kphi::daq {
namespace {

constexpr double kSetting = 0.011;  // V and A: the coarsest step of a supply, and rounding

Trip supply_trip(std::string reason) {
  Trip trip;
  trip.reason = "supply: " + std::move(reason);
  trip.source = Source::supply;
  return trip;
}

std::optional<Trip> moved(const char* what, double now, double wanted, const char* unit) {
  if (std::abs(now - wanted) <= kSetting) return std::nullopt;
  return supply_trip(
      fmt::format("{} is {:g} {}, kphi set {:g} {}: changed on the front panel", what, now, unit, wanted, unit));
}

}  // namespace

std::string tripped_words(const results::SupplyReading& seen) {
  return fmt::format("supply: {} protection switched the output off", name_of(seen.protection));
}

std::optional<Trip> check(const results::SupplyReading& seen, const profiles::SupplyConfig& wanted, bool settled) {
  const double volts = wanted.voltage.value();
  const bool limits = seen.regulation == results::SupplyRegulation::constant_current;
  if (seen.protection != results::SupplyProtection::none) {
    Trip trip = supply_trip("");
    trip.reason = tripped_words(seen);
    trip.protection = seen.protection;
    return trip;
  }
  if (seen.output == 0) return supply_trip("output is off");
  if (limits && settled)
    return supply_trip(fmt::format("current limit reached: {:.3g} A at {:.4g} V", seen.current_a, seen.voltage_v));
  if (auto trip = moved("set voltage", seen.set_voltage_v, volts, "V")) return trip;
  if (auto trip = moved("current limit", seen.current_limit_a, wanted.current_limit.value(), "A")) return trip;
  if (!settled) return std::nullopt;
  // Written so that NaN trips.
  if (!(seen.voltage_v >= (1 - results::kSupplySag) * volts))
    return supply_trip(fmt::format("{:.4g} V at the terminals, more than {:g} % below the {:g} V set", seen.voltage_v,
                                   100 * results::kSupplySag, volts));
  if (seen.voltage_v > (1 + results::kSupplyRise) * volts)
    return supply_trip(
        fmt::format("{:.4g} V at the terminals, more than {:g} % above the {:g} V set: the motor feeds back",
                    seen.voltage_v, 100 * results::kSupplyRise, volts));
  return std::nullopt;
}

}  // namespace kphi::daq
