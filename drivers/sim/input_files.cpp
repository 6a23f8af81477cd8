#include "drivers/sim/input_files.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "base/error.hpp"

namespace kphi::sim {
namespace {

constexpr const char* kFaultFormat = "kphi-faults/1";
constexpr const char* kMotorFormat = "kphi-sim-motor/1";

using Members = std::map<std::string, YAML::Node>;

[[noreturn]] void refuse(const std::string& path, const YAML::Mark& mark, const std::string& what,
                         const std::string& next_move) {
  throw ConfigurationError(fmt::format("{}:{}:{}: {}; {}", path, mark.line + 1, mark.column + 1, what, next_move));
}

/// Of a map, each key once.
Members members(const YAML::Node& map, const std::string& path) {
  if (!map.IsMap()) refuse(path, map.Mark(), "not a map of keys and values", "write key: value");
  Members all;
  for (const auto& member : map) {
    if (!member.first.IsScalar()) refuse(path, member.first.Mark(), "a key must be one word", "write key: value");
    const bool fresh = all.emplace(member.first.Scalar(), member.second).second;
    if (!fresh)
      refuse(path, member.first.Mark(), fmt::format("\"{}\" appears twice", member.first.Scalar()), "keep one");
  }
  return all;
}

/// Gives a map of single values to `take`, and says where in it what `take` refuses is.
void read_entry(const YAML::Node& node, const std::string& path, const char* next_move, auto&& take) {
  const Members all = members(node, path);
  FaultEntry entry;
  for (const auto& [key, value] : all) {
    if (!value.IsScalar()) refuse(path, value.Mark(), fmt::format("{} must be a single value", key), "write one");
    entry[key] = value.Scalar();
  }
  try {
    take(entry);
  } catch (const FaultEntryError& error) {
    const auto at = all.find(error.key);
    refuse(path, at == all.end() ? node.Mark() : at->second.Mark(), error.what(), next_move);
  }
}

/// The members of a file, without its format.
Members file_of(const std::string& text, const std::string& path, const char* format) {
  try {
    const YAML::Node root = YAML::Load(text);
    Members all = members(root, path);
    const auto found = all.find("format");
    if (found == all.end() || !found->second.IsScalar() || found->second.Scalar() != format)
      refuse(path, root.Mark(), fmt::format("the format is not {}", format),
             fmt::format("begin with format: {}", format));
    all.erase(found);
    return all;
  } catch (const YAML::Exception& error) {
    refuse(path, error.mark, error.msg, "fix the YAML");
  }
}

struct MotorRow {
  std::string_view section, name;
  double& (*of)(MotorProfile& profile);
  double low, high;
};

template <auto Member>
constexpr MotorRow row(std::string_view section, std::string_view name, double low, double high) {
  if constexpr (requires(MotorParameters & motor) { motor.*Member; }) {
    return {section, name, [](MotorProfile& profile) -> double& { return profile.motor.*Member; }, low, high};
  } else {
    return {section, name, [](MotorProfile& profile) -> double& { return profile.sensors.*Member; }, low, high};
  }
}

using M = MotorParameters;
using E = IqSensorErrors;
constexpr std::array kRows{
    row<&M::torque_constant>("motor", "torque_constant_nm_a", 1e-4, 1),
    row<&M::resistance>("motor", "resistance_ohm", 1e-3, 10),
    row<&M::winding_resistance>("motor", "winding_resistance_ohm", 1e-3, 10),
    row<&M::copper_coefficient>("motor", "copper_coefficient_per_degc", 0, 0.01),
    row<&M::rotor_inertia>("motor", "rotor_inertia_kg_m2", 1e-8, 1e-2),
    row<&M::friction_torque>("motor", "friction_torque_nm", 0, 1),
    row<&M::viscous_friction>("motor", "viscous_friction_nm_s", 0, 1e-2),
    row<&M::turbulence>("motor", "turbulence_relative", 0, 0.5),
    row<&M::supply_volts>("supply", "voltage_v", 1, 60),
    row<&M::source_resistance>("supply", "source_resistance_ohm", 1e-3, 10),
    row<&M::supply_current_max>("supply", "current_max_a", 0.1, 1000),
    row<&M::supply_foldback>("supply", "foldback_relative", 0, 1),
    row<&M::bus_capacitance>("supply", "bus_capacitance_f", 1e-6, 1),
    row<&M::idle_current>("supply", "idle_current_a", 0, 5),
    row<&M::coil_capacity>("heat", "coil_capacity_j_per_degc", 0.1, 1e4),
    row<&M::coil_free_convection>("heat", "coil_free_convection_w_per_degc", 0, 100),
    row<&M::coil_forced_convection>("heat", "coil_forced_convection_w_per_degc_root_rad_s", 0, 10),
    row<&M::coil_to_stator>("heat", "coil_to_stator_w_per_degc", 0, 100),
    row<&M::stator_capacity>("heat", "stator_capacity_j_per_degc", 0.1, 1e4),
    row<&M::stator_convection>("heat", "stator_convection_w_per_degc", 0, 100),
    row<&M::controller_resistance>("heat", "controller_resistance_ohm", 0, 1),
    row<&M::controller_to_ambient>("heat", "controller_to_ambient_degc_per_w", 0, 1000),
    row<&M::controller_seconds>("heat", "controller_time_constant_s", 0.1, 1e5),
    row<&M::controller_own_warmth>("heat", "controller_own_warmth_degc", 0, 100),
    row<&M::ambient_celsius>("heat", "ambient_degc", -40, 80),
    row<&E::volts_gain>("sensors", "voltage_gain_error_relative", -0.5, 0.5),
    row<&E::amps_gain>("sensors", "current_gain_error_relative", -0.5, 0.5),
    row<&E::amps_bias>("sensors", "current_bias_ticks", -1000, 1000),
    row<&E::converter_noise>("sensors", "converter_noise_ticks", 0, 1000),
    row<&E::speed_noise>("sensors", "speed_noise_rad_s", 0, 1000),
    row<&E::speed_filter_hz>("sensors", "speed_filter_hz", 0, 1e5),
    row<&E::controller_noise>("sensors", "controller_noise_degc", 0, 50),
};

void set(MotorProfile& profile, const std::string& section, const std::string& key, const std::string& text) {
  const auto found =
      std::ranges::find_if(kRows, [&](const MotorRow& row) { return row.section == section && row.name == key; });
  if (found == kRows.end())
    throw FaultEntryError(key, fmt::format("{} has no key \"{}\", see profiles/motor_iq2306.yaml", section, key));
  try {
    found->of(profile) = fault_number(key, text, found->low, found->high);
  } catch (const FaultEntryError& error) {
    throw FaultEntryError(key, fmt::format("{}: {}", key, error.what()));
  }
}

}  // namespace

FaultFile parse_faults(const std::string& text, const std::string& path) {
  FaultFile file;
  const Members all = file_of(text, path, kFaultFormat);
  for (const auto& [key, value] : all) {
    if (key != "faults" && key != "quirks")
      refuse(path, value.Mark(), fmt::format("unknown key \"{}\"", key), "remove it");
  }
  const auto faults = all.find("faults");
  if (faults == all.end() || !faults->second.IsSequence())
    refuse(path, {}, "there is no list of faults", "write faults: and a list of entries, or []");
  for (const auto& entry : faults->second) {
    read_entry(entry, path, "fix this entry", [&](const FaultEntry& e) { file.faults.push_back(fault_of(e)); });
  }
  const auto quirks = all.find("quirks");
  if (quirks == all.end()) return file;
  read_entry(quirks->second, path, "fix this quirk", [&](const FaultEntry& entry) {
    for (const auto& [name, value] : entry) set_quirk(file.quirks, name, value);
  });
  return file;
}

void load_faults(const std::string& text, const std::string& path, BenchSettings& bench) {
  FaultFile file = parse_faults(text, path);
  if (!bench.supply && std::ranges::any_of(file.faults, [](const Fault& f) { return on_supply(f.kind); }))
    throw ConfigurationError(path + ": faults of the supply, but the bench file has no supply:; remove them");
  bench.faults = std::move(file.faults);
  bench.netbox.quirks = file.quirks;
}

MotorProfile parse_motor_profile(const std::string& text, const std::string& path) {
  MotorProfile profile;
  for (const auto& [section, node] : file_of(text, path, kMotorFormat)) {
    const bool known = std::ranges::find(kRows, section, &MotorRow::section) != kRows.end();
    if (!known) refuse(path, node.Mark(), fmt::format("unknown key \"{}\"", section), "remove it");
    read_entry(node, path, "fix this entry", [&profile, &name = section](const FaultEntry& entry) {
      for (const auto& [key, value] : entry) set(profile, name, key, value);
    });
  }
  return profile;
}

}  // namespace kphi::sim
