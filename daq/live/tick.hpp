// What the bench shows at one moment, as plain words of memory: the runner writes it a hundred times a second, and
// whoever looks on reads the newest whole.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string_view>

#include "daq/guard_limits.hpp"

namespace kphi::daq::live {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// What is unknown or no longer fresh is kUnknown. Members are eight bytes or multiples: the whole has no gaps.
struct Tick {
  double time_s = 0;              ///< bench time
  double timestamp_s = 0;         ///< calendar time, seconds since 1970, UTC
  double progress = 0;            ///< of the campaign, 0 to 1
  double remaining_s = kUnknown;  ///< of the campaign, as a person's clock runs
  double occlusion_deg = kUnknown;
  double commanded_rpm = 0;
  double speed_rpm = kUnknown;
  double thrust_n = kUnknown;   ///< zero subtracted
  double torque_nm = kUnknown;  ///< about the thrust axis, zero subtracted
  double speed_age_s = 0, thrust_age_s = 0;
  double module_v = kUnknown, module_a = kUnknown;  ///< at the motor module's input
  double supply_v = kUnknown, supply_a = kUnknown;  ///< at the bench supply's terminals
  double coil_degc = kUnknown;
  double derate = kUnknown;                     ///< 1: none
  std::array<double, kWatchedCount> watched{};  ///< see limit_values()
  std::uint64_t fault_bits = 0;
  std::uint64_t received = 0, lost_network = 0, lost_host = 0;  ///< samples of this run
  std::int64_t repetition = 0, repetitions = 0;                 ///< 1-based
  std::int64_t step = -1, steps = 0;                            ///< 0-based; -1 outside steps
  std::array<char, 24> phase{}, propeller{};                    ///< cut off, zero-terminated
};

/// Copies what fits.
template <std::size_t N>
void write(std::array<char, N>& to, std::string_view text) noexcept {
  to = {};
  text.copy(to.data(), N - 1);
}

}  // namespace kphi::daq::live
