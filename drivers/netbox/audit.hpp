// A box's configuration against what is to be measured with it. Pure functions.
#pragma once

#include <span>
#include <vector>

#include "drivers/netbox/configuration.hpp"
#include "drivers/netbox/finding.hpp"

namespace kphi::netbox {

/// What the campaign will do. Zero or empty: not known, not audited.
struct Intention {
  std::vector<double> speeds_rpm;  ///< steps of the profile
  int blades = 0;
  double largest_thrust_n = 0;   ///< expected on `thrust_axis`
  double largest_torque_nm = 0;  ///< expected about `thrust_axis`
  int thrust_axis = 2;           ///< 0..2
  double rate_hz = 0;            ///< expected of the box
  int records_per_datagram = 0;  ///< expected of the box
  double alias_limit_hz = 2;     ///< lines that appear below are constant over a step: they spoil its mean
};

/// A line of the rotor that the box's rate folds down to nearly constant.
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
