// The messages for pages and plotters: one JSON object each. Units are in the keys; an unknown or stale number is null.
//
//   hello    once, first: format "kphi-live/2", replay (bool), by_hand (bool), weighs (bool), name, propeller,
//            speed_max_rpm, limits as in `limits`
//   history  once, second: trace [[time_s, thrust_n, commanded_rpm, speed_rpm], …], messages [limits, step, line, stop,
//            reached, end, …]
//   limits   the guard's limits from now on: limits [{key, name, unit, limit, lower (bool), source}]
//   tick     30 times a second: time_s, progress (0 to 1), remaining_s, propeller, phase ("" in a step), step (0-based,
//            -1 outside steps), steps, occlusion_deg, repetition (1-based), repetitions, run (1-based, 0: not of a
//            campaign), runs, samples (of the campaign), commanded_rpm, speed_rpm, speed_age_s, thrust_n, thrust_age_s,
//            torque_nm, module_v, module_a, supply_v, supply_a, coil_degc, derate, fault_bits, vibration [rms of Fx …
//            Tz, N and N m], blade_pass_hz, blade_pass_n, received, lost_network, lost_host, watched {key: value, …} of
//            every guarded quantity, silent_s (since the runner's last tick), dropped (frames and messages that this
//            page did not get)
//   step     a step is over: occlusion_deg, repetition, step, speed_rpm, speed2_rad2_s2, thrust_n, k_n_s2, u_k_n_s2, n
//   line     a line of the log: time_s, text
//   ask      a person is asked this in the terminal, the rotor is at rest and locked meanwhile: text ("": answered),
//            occlusion_deg, repetition and run of the next run, has_power (false: kphi has switched the motor's supply
//            off), drawing (SVG of what is to be mounted, or "")
//   reached  what the campaign knows so far: text
//   stop     STOP was pressed on a page: time_s
//   end      the run is over: time_s, well (bool), at_rest (bool: the rotor was seen at rest, or has not turned), text
//
// A page sends "stop"; where the motor is turned by hand also "up", "down", "hold"; where a mass is weighed "hold".
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "compensation/units.hpp"
#include "daq/guard/guard_limits.hpp"
#include "daq/guard/observation.hpp"
#include "daq/run/progress.hpp"
#include "daq/run/steering.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq::live {

struct Subject {
  bool replay = false;  ///< a recorded run, which cannot be stopped
  std::string name;     ///< of the campaign, or of the file
  std::string propeller;
  double speed_max_rpm = 0;        ///< of the profile: the top of the speed axis
  Seconds minimum_discard;         ///< at the start of every step, not averaged
  std::vector<GuardLimit> limits;  ///< until a guard publishes its own
  bool by_hand = false;            ///< pages may press up, down and hold
  bool weighs = false;             ///< no motor: pages say that the mass is on or off, by hold
  bool simulated = false;          ///< no device moves
};

/// `devices`: their reported limits; nullptr: limits of the files only.
[[nodiscard]] inline Subject subject_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                                        const DeviceLimits* devices = nullptr) {
  const double first = to_rpm(campaign.profile.first), last = to_rpm(campaign.profile.last);
  return {false,
          campaign.name,
          campaign.propeller.name,
          first > last ? first : last,
          campaign.minimum_discard,
          combine_limits(campaign, config, devices),
          false,
          false,
          config.simulation.has_value()};
}

/// Members are eight bytes or multiples: no padding.
struct Tick {
  double time_s = 0;       ///< bench time
  double timestamp_s = 0;  ///< calendar time, seconds since 1970, UTC
  Position position;
  Observation seen;

  /// kUnknown if stale.
  [[nodiscard]] double speed_rpm() const { return seen.motor_is_fresh() ? to_rpm(seen.speed()) : kUnknown; }
  [[nodiscard]] double thrust_n() const { return seen.load_cell_is_fresh() ? seen.thrust_n : kUnknown; }
};

inline constexpr const char* kStopWord = "stop";
struct SteeringWord {
  std::string_view text;
  Key key;
};
inline constexpr SteeringWord kSteeringWords[] = {{"up", Key::up}, {"down", Key::down}, {"hold", Key::hold}};

/// Preliminary k of a step, right after it. The record uses the raw samples (results/reduction).
struct StepFigures {
  std::size_t n = 0;       ///< number of ticks; 0: no result
  double thrust_n = 0;     ///< mean
  double speed_rad_s = 0;  ///< root of the mean square
  double k = 0;            ///< N/(rad/s)²: mean thrust over mean ω²
  double u_k = 0;          ///< standard uncertainty, from the scatter of successive means; not finite: unknown
};

/// A message for all pages, and how long a page that joins late needs it.
struct Message {
  enum class Kind { limits, step, other } kind = Kind::other;
  std::string text;  ///< JSON
};

[[nodiscard]] std::string hello_message(const Subject& subject);
[[nodiscard]] Message limits_message(const std::vector<GuardLimit>& limits);
[[nodiscard]] std::string tick_message(const Tick& tick, double silent_s, std::uint64_t dropped);
[[nodiscard]] Message step_message(const Position& at, const StepFigures& seen);
[[nodiscard]] Message line_message(double time_s, const std::string& text);
[[nodiscard]] Message ask_message(const StandQuestion& question);
[[nodiscard]] Message reached_message(const std::string& text);
[[nodiscard]] Message stop_message(double time_s);
[[nodiscard]] Message end_message(double time_s, bool well, bool at_rest, const std::string& text);

/// For plotters (PlotJuggler's UDP server): `timestamp` in seconds since 1970; only numbers, none that is unknown;
/// limit_share {key: 1 at the limit, …}; fewer than 1400 bytes.
[[nodiscard]] std::string plot_message(const Tick& tick, const std::vector<GuardLimit>& limits);

}  // namespace kphi::daq::live
