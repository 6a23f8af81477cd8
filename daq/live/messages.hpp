// The messages for pages and plotters: one JSON object each. Units are in the keys; an unknown or stale number is null.
//
//   hello    once, first: format "kphi-live/2", replay (bool), name, propeller, speed_max_rpm, limits as in `limits`
//   history  once, second: trace [[time_s, thrust_n, commanded_rpm, speed_rpm], …], messages [limits, step, line, stop,
//            end, …]
//   limits   the guard's limits from now on: limits [{key, name, unit, limit, lower (bool), source}]
//   tick     30 times a second: time_s, progress (0 to 1), remaining_s, propeller, phase ("" in a step), step (0-based,
//            -1 outside steps), steps, occlusion_deg, repetition (1-based), repetitions, commanded_rpm, speed_rpm,
//            speed_age_s, thrust_n, thrust_age_s, torque_nm, module_v, module_a, supply_v, supply_a, coil_degc, derate,
//            fault_bits, received, lost_network, lost_host, watched {key: value, …} of every guarded quantity,
//            silent_s (since the runner's last tick), dropped (frames and messages that this page did not get)
//   step     a step is over: occlusion_deg, repetition, step, speed_rpm, speed2_rad2_s2, thrust_n, k_n_s2, u_k_n_s2, n
//   line     a line of the log: time_s, text
//   stop     STOP was pressed on a page: time_s
//   end      the run is over: time_s, well (bool), text
//
// A page sends one word: "stop".
#pragma once

#include <string>

#include "daq/live/quick_look.hpp"
#include "daq/live/subject.hpp"
#include "daq/live/tick.hpp"

namespace kphi::daq::live {

inline constexpr const char* kStopWord = "stop";

/// A message for all pages, and how long a page that joins late needs it.
struct Message {
  enum class Kind { limits, step, other } kind = Kind::other;
  std::string text;  ///< JSON
};

[[nodiscard]] std::string hello_message(const Subject& subject);
[[nodiscard]] Message limits_message(const std::vector<GuardLimit>& limits);
[[nodiscard]] std::string tick_message(const Tick& tick, double silent_s, std::uint64_t dropped);
[[nodiscard]] Message step_message(const Tick& at, const QuickLook::Result& seen);
[[nodiscard]] Message line_message(double time_s, const std::string& text);
[[nodiscard]] Message stop_message(double time_s);
[[nodiscard]] Message end_message(double time_s, bool well, const std::string& text);

/// For plotters (PlotJuggler's UDP server): `timestamp` in seconds since 1970; numbers only, unknown ones are absent;
/// limit_share {key: 1 at the limit, …}; fewer than 1400 bytes.
[[nodiscard]] std::string plot_message(const Tick& tick, const std::vector<GuardLimit>& limits);

}  // namespace kphi::daq::live
