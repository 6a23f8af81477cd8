// What pages and plotters are told: one JSON object per message. Units are in the keys; a number that is unknown or no
// longer fresh is null.
//
//   hello    once, first: format "kphi-live/2", replay (bool), name, propeller, speed_max_rpm, limits as in `limits`
//   history  once, second: trace [[time_s, thrust_n, commanded_rpm, speed_rpm], …], messages [limits, step, line, stop,
//            end, …]
//   limits   what the guard holds the run to from now on: limits [{key, name, unit, limit, lower (bool), source}]
//   tick     30 times a second: time_s, progress (0 to 1), remaining_s, propeller, phase ("" in a step), step (0-based,
//            -1 outside steps), steps, occlusion_deg, repetition (1-based), repetitions, commanded_rpm, speed_rpm,
//            speed_age_s, thrust_n, thrust_age_s, torque_nm, module_v, module_a, supply_v, supply_a, coil_degc, derate,
//            fault_bits, received, lost_network, lost_host, watched {key: value, …} of all that can have a limit,
//            silent_s (the runner's last word), dropped (frames and messages that this page did not get)
//   step     a step is over: occlusion_deg, repetition, step, speed_rpm, speed2_rad2_s2, thrust_n, k_n_s2, u_k_n_s2, n
//   line     something was said: time_s, text
//   stop     STOP was asked on a page: time_s
//   end      the run is over: time_s, well (bool), text
//
// A page says one thing: "stop".
#pragma once

#include <string>

#include "daq/live/quick_look.hpp"
#include "daq/live/subject.hpp"
#include "daq/live/tick.hpp"

namespace kphi::daq::live {

inline constexpr const char* kStopWord = "stop";

[[nodiscard]] std::string hello_message(const Subject& subject);
[[nodiscard]] std::string limits_message(const std::vector<LimitBar>& limits);
[[nodiscard]] std::string tick_message(const Tick& tick, double silent_s, std::uint64_t dropped);
[[nodiscard]] std::string step_message(const Tick& at, const QuickLook::Result& seen);
[[nodiscard]] std::string line_message(double time_s, const std::string& text);
[[nodiscard]] std::string stop_message(double time_s);
[[nodiscard]] std::string end_message(double time_s, bool well, const std::string& text);

/// For plotters (PlotJuggler's UDP server): `timestamp` in seconds since 1970; numbers only, unknown ones are absent;
/// limit_share {key: 1 at the limit, …}; fewer than 1400 bytes.
[[nodiscard]] std::string plot_message(const Tick& tick, const std::vector<LimitBar>& limits);

}  // namespace kphi::daq::live
