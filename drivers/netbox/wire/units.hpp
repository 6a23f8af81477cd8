// The box's units in SI, by code (ForceUnit, TorqueUnit) and by name.
#pragma once

#include <optional>
#include <span>

namespace kphi::netbox {

struct Unit {
  const char* name;
  int code;
  double si;  ///< newtons or newton-metres in one
};

[[nodiscard]] std::span<const Unit> force_units() noexcept;
[[nodiscard]] std::span<const Unit> torque_units() noexcept;
/// nullopt for an unknown code.
[[nodiscard]] std::optional<double> newtons_in(int force_unit_code) noexcept;
[[nodiscard]] std::optional<double> newton_metres_in(int torque_unit_code) noexcept;

}  // namespace kphi::netbox
