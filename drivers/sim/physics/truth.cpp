#include "drivers/sim/physics/truth.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "compensation/units.hpp"

namespace kphi::sim {
namespace {

double in_si(double n_rpm2) noexcept { return from_newtons_per_rpm2(n_rpm2).value(); }

void append_propeller(std::string& out, const PropellerTruth& propeller) {
  auto to = std::back_inserter(out);
  fmt::format_to(to, "  {}:\n    diameter_in: {}\n    blades: {}\n    K_T: {}\n", propeller.id, propeller.diameter_in,
                 propeller.blades, in_si(propeller.thrust_n_rpm2));
  fmt::format_to(to, "    line: {{intercept: {}, slope_per_deg: {}}}\n    k:\n", in_si(propeller.line_intercept_n_rpm2),
                 in_si(propeller.line_slope_n_rpm2_deg));
  for (const double phi : kOcclusionsDeg) {
    fmt::format_to(to, "      - {{phi_deg: {}, k: {}}}\n", phi, thrust_coefficient(propeller, phi));
  }
}

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

std::string truth_yaml(std::uint64_t seed) {
  std::string out = fmt::format("format: kphi-truth/1\nseed: {}\nk_unit: N/(rad/s)^2\npropellers:\n", seed);
  for (const auto& propeller : kPropellers) append_propeller(out, propeller);
  return out;
}

}  // namespace kphi::sim
