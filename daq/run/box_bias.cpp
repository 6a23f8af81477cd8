#include "daq/run/box_bias.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace kphi::daq {
namespace {

constexpr std::array kAxes{"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

const char* unit_of(std::size_t axis) { return axis < 3 ? "N" : "N m"; }

}  // namespace

std::optional<std::string> unrest(const netbox::ZeroMeasurement& before) {
  if (before.records < 2) return "no valid sample arrived";
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const double allowed = axis < 3 ? kNoisyForce : kNoisyTorque;
    const double deviation = before.standard_deviation[axis];
    if (deviation <= allowed) continue;  // so written that NaN is refused
    return fmt::format("{} is noisy: standard deviation {:.3g} {unit}, limit {:g} {unit}", kAxes[axis], deviation,
                       allowed, fmt::arg("unit", unit_of(axis)));
  }
  return std::nullopt;
}

std::optional<std::string> beyond_zero(const netbox::ZeroMeasurement& after, const netbox::BiasTolerance& tolerance) {
  if (after.records < 2) return "no valid sample arrived afterwards";
  for (std::size_t axis = 0; axis < kAxes.size(); ++axis) {
    const double allowed = axis < 3 ? tolerance.force_n : tolerance.torque_nm;
    if (std::abs(after.mean[axis]) < allowed) continue;
    return fmt::format("{} is {:.4g} {unit} afterwards, limit {:g} {unit}", kAxes[axis], after.mean[axis], allowed,
                       fmt::arg("unit", unit_of(axis)));
  }
  return std::nullopt;
}

results::BoxBias to_bias(const netbox::ZeroMeasurement& before, const netbox::ZeroMeasurement& after) {
  return {std::min(before.records, after.records), before.mean, before.standard_deviation, after.mean,
          after.standard_deviation};
}

}  // namespace kphi::daq
