#include "drivers/sim/motor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "drivers/sim/fault_entry.hpp"
#include "drivers/sim/strict_map.hpp"

namespace kphi::sim {
namespace {

constexpr const char* kFormat = "kphi-sim-motor/1";

struct Row {
  std::string_view section, name;
  double& (*of)(MotorProfile& profile);
  double low, high;
};

template <auto Member>
constexpr Row row(std::string_view section, std::string_view name, double low, double high) {
  if constexpr (requires(MotorParameters & motor) { motor.*Member; }) {
    return {section, name, [](MotorProfile& profile) -> double& { return profile.motor.*Member; }, low, high};
  } else {
    return {section, name, [](MotorProfile& profile) -> double& { return profile.sensors.*Member; }, low, high};
  }
}

using M = MotorParameters;
using S = IqSensorErrors;
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
    row<&S::volts_gain>("sensors", "voltage_gain_error_relative", -0.5, 0.5),
    row<&S::amps_gain>("sensors", "current_gain_error_relative", -0.5, 0.5),
    row<&S::amps_bias>("sensors", "current_bias_ticks", -1000, 1000),
    row<&S::converter_noise>("sensors", "converter_noise_ticks", 0, 1000),
    row<&S::speed_noise>("sensors", "speed_noise_rad_s", 0, 1000),
    row<&S::speed_filter_hz>("sensors", "speed_filter_hz", 0, 1e5),
    row<&S::controller_noise>("sensors", "controller_noise_degc", 0, 50),
};

bool is_section(std::string_view name) {
  return std::any_of(kRows.begin(), kRows.end(), [&](const Row& row) { return row.section == name; });
}

void read_section(const std::string& section, const YAML::Node& node, const std::string& path, MotorProfile& profile) {
  for (const auto& [key, value] : members(node, path)) {
    const auto found = std::find_if(kRows.begin(), kRows.end(), [&name = key, &section](const Row& row) {
      return row.section == section && row.name == name;
    });
    if (found == kRows.end()) {
      refuse(path, value.Mark(), fmt::format("{} has no '{}'", section, key), "see profiles/motor_iq2306.yaml");
    }
    try {
      found->of(profile) = fault_number(key, scalar(key, value, path), {found->low, found->high});
    } catch (const FaultEntryError& error) {
      refuse(path, value.Mark(), fmt::format("{}: {}", key, error.what()), "mend it");
    }
  }
}

}  // namespace

MotorProfile parse_motor_profile(const std::string& text, const std::string& path) {
  const YAML::Node root = parse_yaml(text, path);
  auto file = members(root, path);
  const auto format = file.find("format");
  if (format == file.end() || !format->second.IsScalar() || format->second.Scalar() != kFormat)
    refuse(path, root.Mark(), "this is no simulated motor", fmt::format("begin it with format: {}", kFormat));
  file.erase(format);
  MotorProfile profile;
  for (const auto& [section, node] : file) {
    if (!is_section(section)) refuse(path, node.Mark(), fmt::format("unknown key '{}'", section), "remove it");
    read_section(section, node, path, profile);
  }
  return profile;
}

std::string motor_profile_yaml(const MotorProfile& profile) {
  std::string text = fmt::format("format: {}\n", kFormat);
  std::string_view section;
  MotorProfile copy = profile;
  for (const Row& row : kRows) {
    if (row.section != section) text += fmt::format("{}:\n", row.section);
    section = row.section;
    text += fmt::format("  {}: {}\n", row.name, row.of(copy));
  }
  return text;
}

}  // namespace kphi::sim
