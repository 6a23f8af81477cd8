#include "drivers/sim/physics/truth.hpp"

#include <algorithm>

#include "compensation/units.hpp"

namespace kphi::sim {
namespace {

double in_si(double n_rpm2) noexcept { return from_newtons_per_rpm2(n_rpm2).value(); }

}  // namespace

const PropellerTruth* find_propeller(std::string_view id) noexcept {
  const auto found = std::ranges::find(kPropellers, id, &PropellerTruth::id);
  return found == kPropellers.end() ? nullptr : &*found;
}

double thrust_coefficient(const PropellerTruth& propeller, double occlusion_deg) noexcept {
  if (occlusion_deg == 0) return in_si(propeller.thrust_n_rpm2);
  return std::max(0.0, in_si(propeller.line_intercept_n_rpm2 + propeller.line_slope_n_rpm2_deg * occlusion_deg));
}

double torque_coefficient(const PropellerTruth& propeller, double occlusion_deg) noexcept {
  return propeller.torque_nm_rad2_s2 * (1.0 - 0.08 * occlusion_deg / 360.0);
}

}  // namespace kphi::sim
