// Checks a box's configuration against the campaign. Pure functions.
#pragma once

#include <span>
#include <vector>

#include "base/finding.hpp"
#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

/// The campaign. Zero or empty: unknown, not checked.
struct Intention {
  std::vector<double> speeds_rpm;  ///< steps of the profile
  int blades = 0;
  double largest_thrust_n = 0;   ///< expected on `thrust_axis`
  int thrust_axis = 2;           ///< 0..2
  double rate_hz = 0;            ///< expected of the box
  int records_per_datagram = 0;  ///< expected of the box
  double alias_limit_hz = 2;     ///< lines that appear below this are constant over a step and falsify its mean
};

/// A line of the rotor that aliases to a nearly constant force.
struct AliasedLine {
  double speed_rpm = 0;
  int per_revolution = 1;  ///< 1: imbalance; number of blades: blade-pass
  double true_hz = 0;
  double apparent_hz = 0;
};

/// 1/rev and blade-pass lines above half of `rate_hz` that appear below `limit_hz`, in the order of `speeds_rpm`.
[[nodiscard]] std::vector<AliasedLine> aliased_lines(double rate_hz, std::span<const double> speeds_rpm, int blades,
                                                     double limit_hz);

/// Worst first.
[[nodiscard]] std::vector<Finding> audit(const Configuration& box, const Intention& intention = {});

}  // namespace kphi::netbox
