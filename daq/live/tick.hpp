// What the bench shows at one moment, trivially copyable: the runner writes it a hundred times a second, the live view
// reads the newest as a whole.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "daq/guard/observation.hpp"

namespace kphi::daq::live {

using daq::kUnknown;

/// Unknown and stale values are kUnknown. Members are eight bytes or multiples: no padding.
struct Tick {
  double time_s = 0;              ///< bench time
  double timestamp_s = 0;         ///< calendar time, seconds since 1970, UTC
  double progress = 0;            ///< of the campaign, 0 to 1
  double remaining_s = kUnknown;  ///< of the campaign, wall clock
  double occlusion_deg = kUnknown;
  double commanded_rpm = 0;
  double speed_rpm = kUnknown;
  double thrust_n = kUnknown;   ///< zero subtracted
  double torque_nm = kUnknown;  ///< about the thrust axis, zero subtracted
  double speed_age_s = 0, thrust_age_s = 0;
  double module_v = kUnknown, module_a = kUnknown;  ///< at the motor module's input
  double supply_v = kUnknown, supply_a = kUnknown;  ///< at the bench supply's terminals
  double coil_degc = kUnknown;
  double derate = kUnknown;  ///< 1: none
  GuardedValues watched;     ///< as the guard judged them
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
