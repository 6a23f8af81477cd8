#include "profiles/thrust_prior.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace kphi::profiles {
namespace {

constexpr double kInch = 5;  // diameter of those below

struct Measured {
  int blades;
  double low, high;  // N/(rad/s)²: medians per propeller
};

// Eight 5-inch propellers on ten motors at two voltages, Series 1520 stand: github.com/StrawsonDesign/
// motor_propeller_testing; k by least squares through the origin.
constexpr std::array<Measured, 3> kFiveInch{{{2, 1.02e-6, 1.16e-6}, {3, 1.12e-6, 1.38e-6}, {4, 1.54e-6, 1.54e-6}}};

}  // namespace

std::optional<ThrustPrior> thrust_prior(const Propeller& propeller) {
  const double ratio = propeller.diameter_in / kInch;
  if (ratio < 0.9 || ratio > 1.3) return std::nullopt;  // the D⁴ law is not reliable further away
  for (const Measured& measured : kFiveInch) {
    if (measured.blades != propeller.blades) continue;
    const double scale = std::pow(ratio, 4);
    return ThrustPrior{ThrustCoefficient(measured.low * scale), ThrustCoefficient(measured.high * scale),
                       fmt::format("{}-blade 5-inch propellers on a Series 1520 stand{}", propeller.blades,
                                   ratio == 1 ? "" : ", times (D / 5 in)^4")};
  }
  return std::nullopt;
}

}  // namespace kphi::profiles
