#include "drivers/sim/physics/stand.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "compensation/units.hpp"

namespace kphi::sim {
namespace {

constexpr double kBendEnds = 270;  // degrees

ThrustLaw law_of(const StandParameters& stand, const PropellerTruth& propeller) {
  const auto in_si = [](double n_rpm2) { return from_newtons_per_rpm2(n_rpm2).value(); };
  return stand.law.value_or(ThrustLaw{in_si(propeller.thrust_n_rpm2), in_si(propeller.line_intercept_n_rpm2),
                                      in_si(propeller.line_slope_n_rpm2_deg)});
}

void append_propeller(std::string& out, const PropellerTruth& propeller, const StandParameters& stand) {
  auto to = std::back_inserter(out);
  const ThrustLaw law = law_of(stand, propeller);
  fmt::format_to(to, "  {}:\n    diameter_in: {}\n    blades: {}\n    K_T: {}\n", propeller.id, propeller.diameter_in,
                 propeller.blades, law.K_T);
  fmt::format_to(to, "    line: {{intercept: {}, slope_per_deg: {}}}\n    k:\n", law.intercept, law.slope_per_deg);
  for (const double phi : kOcclusionsDeg)
    fmt::format_to(to, "      - {{phi_deg: {}, k: {}}}\n", phi, stand.k(propeller, phi));
}

}  // namespace

double StandParameters::k(const PropellerTruth& propeller, double true_deg) const {
  if (!law && bend == 0) return thrust_coefficient(propeller, true_deg);
  const ThrustLaw own = law_of(*this, propeller);
  if (true_deg == 0) return own.K_T;
  const double along = true_deg / kBendEnds;
  return std::max(0.0, own.intercept + own.slope_per_deg * true_deg + 4 * bend * own.K_T * along * (1 - along));
}

double StandParameters::true_deg(double named_deg) const {
  const auto found = std::ranges::find(plates, named_deg, &Plate::named_deg);
  return found == plates.end() ? named_deg : found->true_deg;
}

std::string truth_yaml(std::uint64_t seed, const StandParameters& stand) {
  std::string out = fmt::format("format: kphi-truth/1\nseed: {}\nk_unit: N/(rad/s)^2\npropellers:\n", seed);
  for (const auto& propeller : kPropellers) append_propeller(out, propeller, stand);
  return out;
}

}  // namespace kphi::sim
