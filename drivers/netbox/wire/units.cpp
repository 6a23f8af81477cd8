#include "drivers/netbox/wire/units.hpp"

#include <algorithm>

#include "drivers/netbox/wire/codes.hpp"

namespace kphi::netbox {
namespace {

constexpr double kLbf = 4.4482216152605, kKgf = 9.80665;

constexpr Unit kForceUnits[] = {
    {"N", static_cast<int>(ForceUnit::newton), 1.0}, {"kN", static_cast<int>(ForceUnit::kilonewton), 1000.0},
    {"lbf", static_cast<int>(ForceUnit::lbf), kLbf}, {"klbf", static_cast<int>(ForceUnit::klbf), 1000.0 * kLbf},
    {"kgf", static_cast<int>(ForceUnit::kgf), kKgf}, {"gf", static_cast<int>(ForceUnit::gf), 1e-3 * kKgf},
};

constexpr Unit kTorqueUnits[] = {
    {"Nm", static_cast<int>(TorqueUnit::newton_metre), 1.0},
    {"N-m", static_cast<int>(TorqueUnit::newton_metre), 1.0},
    {"Nmm", static_cast<int>(TorqueUnit::newton_millimetre), 1e-3},
    {"N-mm", static_cast<int>(TorqueUnit::newton_millimetre), 1e-3},
    {"kg-cm", static_cast<int>(TorqueUnit::kgf_centimetre), 1e-2 * kKgf},
    {"kgf-cm", static_cast<int>(TorqueUnit::kgf_centimetre), 1e-2 * kKgf},
    {"kNm", static_cast<int>(TorqueUnit::kilonewton_metre), 1000.0},
    {"kN-m", static_cast<int>(TorqueUnit::kilonewton_metre), 1000.0},
    {"lbf-in", static_cast<int>(TorqueUnit::lbf_inch), 0.1129848290276167},
    {"lbf-ft", static_cast<int>(TorqueUnit::lbf_foot), 1.3558179483314004},
};

std::optional<double> si_of(std::span<const Unit> units, int code) noexcept {
  const auto known = std::find_if(units.begin(), units.end(), [&](const Unit& unit) { return unit.code == code; });
  if (known == units.end()) return std::nullopt;
  return known->si;
}

}  // namespace

std::span<const Unit> force_units() noexcept { return kForceUnits; }

std::span<const Unit> torque_units() noexcept { return kTorqueUnits; }

std::optional<double> newtons_in(int force_unit_code) noexcept { return si_of(kForceUnits, force_unit_code); }

std::optional<double> newton_metres_in(int torque_unit_code) noexcept { return si_of(kTorqueUnits, torque_unit_code); }

}  // namespace kphi::netbox
