#include "profiles/limits.hpp"

#include <fmt/format.h>

#include "profiles/profile_reader.hpp"

namespace kphi::profiles {
namespace {

std::optional<Cooling> read_cooling(ProfileReader& file) {
  if (!file.has("/limits/cooling")) return std::nullopt;
  const Cooling cooling{Celsius(file.number("/limits/cooling/pause_above_degc")),
                        Celsius(file.number("/limits/cooling/resume_below_degc"))};
  if (cooling.resume_below.value() > cooling.pause_above.value()) {
    file.refuse("/limits/cooling/resume_below_degc", "is above pause_above_degc", "lower it: a pause would never end");
  }
  return cooling;
}

}  // namespace

Limits read_limits(ProfileReader& file, const std::string& supply_v) {
  Limits limits{read_cooling(file)};
  for (std::size_t i = 0; i < kLimitKeys.size(); ++i)
    limits.values[i] = file.find<double>(fmt::format("/limits/{}", kLimitKeys[i]));
  const auto supply = file.find<double>(supply_v);
  const auto refuse = [&](const char* key, double volts, const char* relation, const char* remedy) {
    file.refuse(std::string("/limits/") + key,
                fmt::format("{:g} V is not {} the {:g} V of {}", volts, relation, *supply, dotted(supply_v)),
                fmt::format("{} it: the motor would never turn", remedy));
  };
  const auto low = limits["supply_voltage_min_v"], high = limits["supply_voltage_max_v"];
  if (supply && low >= supply) refuse("supply_voltage_min_v", *low, "below", "lower");
  if (supply && high && high <= supply) refuse("supply_voltage_max_v", *high, "above", "raise");
  return limits;
}

}  // namespace kphi::profiles
