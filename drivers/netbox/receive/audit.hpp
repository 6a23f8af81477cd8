// A box's configuration against what is to be measured with it. Pure functions.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/configuration/finding.hpp"

namespace kphi::netbox {

/// What the campaign will do. Zero or empty: not known, not audited.
struct Intention {
  std::vector<double> speeds_rpm;  ///< steps of the profile
  int blades = 0;
  double largest_thrust_n = 0;           ///< expected on `thrust_axis`
  double largest_torque_nm = 0;          ///< expected about `thrust_axis`
  int thrust_axis = 2;                   ///< 0..2
  double rate_hz = 0;                    ///< expected of the box
  int records_per_datagram = 0;          ///< expected of the box
  std::size_t receive_buffer_bytes = 0;  ///< granted by the kernel, see LoadCell::receive_buffer_bytes
  double alias_limit_hz = 2;             ///< lines that appear below are constant over a step: they spoil its mean
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

/// What the kernel tells when it grants the 4 MiB asked for: it doubles.
inline constexpr std::size_t kWantedReceiveBytes = std::size_t{8} << 20;

/// How long this process may stand still before the kernel drops datagrams; s, bench time.
[[nodiscard]] double tolerated_standstill_s(std::size_t receive_buffer_bytes, int records_per_datagram, double rate_hz);
/// The kernel has granted less than was asked for: a warning below half a second, else a note. `time_scale`: bench
/// seconds per second.
[[nodiscard]] std::optional<Finding> small_receive_buffer(std::size_t receive_buffer_bytes, int records_per_datagram,
                                                          double rate_hz, double time_scale = 1);

/// Worst first.
[[nodiscard]] std::vector<Finding> audit(const Configuration& box, const Intention& intention = {});

}  // namespace kphi::netbox
