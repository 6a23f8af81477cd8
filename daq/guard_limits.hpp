// What the guard holds the bench to: the limits of campaign, bench and devices in one table. Of several limits on one
// quantity the tightest is in it, and says where it comes from.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daq/bench.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// In the order of the table. The first six: an axis of the load cell as it is read, its zero included.
enum class Watched : std::uint8_t {
  force_x,
  force_y,
  force_z,
  torque_x,
  torque_y,
  torque_z,
  thrust,               ///< N, either sign, zero subtracted
  shaft_torque,         ///< N m about the thrust axis, either sign, zero subtracted
  speed,                ///< RPM, either sign
  speed_error,          ///< % of the command, beside 20 rad/s; see speed_error.hpp
  supply_current,       ///< A into the motor module, as that measures it
  output_current,       ///< A out of the bench supply, as that measures it
  motor_current,        ///< A, the module's estimate
  supply_voltage_low,   ///< V at the motor module
  supply_voltage_high,  ///< V, of the module or of the bench supply
  coil_temperature,     ///< °C, the module's estimate
  load_cell_age,        ///< s of wall time while the motor turns, likewise the next three
  motor_age,
  supply_age,
  pause,            ///< of the runner, while the motor turns
  samples_missing,  ///< s of the load cell's stream in a row, while the motor turns; no row, nor the next
  sleep,            ///< of this computer; any
  state,            ///< no limit: what a device says of itself
};
inline constexpr std::size_t kWatchedCount = static_cast<std::size_t>(Watched::samples_missing);

struct GuardLimit {
  Watched watched{};
  std::string name;
  double value = 0;
  std::string unit;
  std::string source;  ///< "campaign limits.thrust_max_n"
  bool lower = false;  ///< true: trips below it

  friend bool operator==(const GuardLimit&, const GuardLimit&) = default;
};

/// What the devices told when they were connected.
struct DeviceLimits {
  std::array<double, 6> load_cell_range{};  ///< N and N m; 0: not known
  iq::AuditRecord motor;
};

/// Of a connected bench.
[[nodiscard]] DeviceLimits device_limits(Bench& bench);
/// Of a recorded run: what its header holds of them.
[[nodiscard]] DeviceLimits device_limits(const results::RunHeader& header);

/// Sorted by what is watched; what nobody limits has no row. Without `devices`: what the files say.
[[nodiscard]] std::vector<GuardLimit> combine_limits(const profiles::Campaign& campaign, const profiles::Bench& place,
                                                     const DeviceLimits* devices = nullptr);

/// "thrust                               above 20 N        campaign limits.thrust_max_n": where the motor coasts.
[[nodiscard]] std::vector<std::string> to_lines(const std::vector<GuardLimit>& limits);

/// "below 5 V", "above 20 N".
[[nodiscard]] std::string to_words(const GuardLimit& limit);

inline constexpr double kRangeBorne = 1.1;  ///< share of a range of the load cell: beyond it the cell is in danger
inline constexpr double kOvershoot = 1.05;  ///< a closed loop overshoots a little on every step
/// Instrumented, a live bench is many times slower; a bench in process lives in time of its own.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr bool kInstrumented = true;
#else
inline constexpr bool kInstrumented = false;
#endif
[[nodiscard]] inline bool is_slowed(const profiles::Bench& place) {
  return kInstrumented && !(place.simulation && place.simulation->in_process);
}
/// Wall time, of load cell and motor while it turns. Seen twice: after this host has stood still, what waits in the
/// sockets is taken in between.
[[nodiscard]] inline Duration spin_patience(const profiles::Bench& place) {
  return std::chrono::milliseconds(is_slowed(place) ? 500 : 145);
}

}  // namespace kphi::daq
