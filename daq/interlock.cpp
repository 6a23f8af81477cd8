#include "daq/interlock.hpp"

#include <fmt/format.h>

#include <cmath>

namespace kphi::daq {
namespace {

std::optional<Trip> above(const char* what, double value, double limit, const char* unit) {
  // Written so that NaN trips: a value that cannot be compared is no proof of safety.
  if (value <= limit) return std::nullopt;
  return Trip{fmt::format("{} {:.4g} {} is above {:.4g} {}", what, value, unit, limit, unit)};
}

}  // namespace

std::optional<Trip> check(const Observation& seen, const profiles::Limits& limits) {
  // A closed loop overshoots a little on every step; 5 % more is a runaway.
  constexpr double kOvershoot = 1.05;
  // One count of the module's fix16 is 1.5e-5.
  constexpr double kNoDerate = 0.9999;
  if (auto trip = above("speed", to_rpm(seen.speed), kOvershoot * to_rpm(limits.speed_max), "RPM")) return trip;
  if (auto trip = above("thrust", std::abs(seen.thrust.value()), limits.thrust_max.value(), "N")) return trip;
  if (auto trip = above("supply current", seen.supply_current.value(), limits.supply_current_max.value(), "A")) {
    return trip;
  }
  if (auto trip = above("coil temperature", seen.coil_temperature.value(), limits.coil_temperature_max.value(), "°C")) {
    return trip;
  }
  if (seen.fault_bits != 0)
    return Trip{fmt::format("motor: the module reports a fault (bits 0x{:02X})", seen.fault_bits)};
  if (!(seen.derate >= kNoDerate))
    return Trip{fmt::format("motor: the module derates to {:.0f} % of its drive", 100 * seen.derate)};
  return std::nullopt;
}

std::optional<Trip> check_ages(const Observation& seen, Duration patience) {
  const double most = to_seconds(patience);
  if (auto trip = above("age of the newest load-cell sample", to_seconds(seen.load_cell_age), most, "s")) return trip;
  return above("age of the newest motor reading", to_seconds(seen.motor_age), most, "s");
}

}  // namespace kphi::daq
