// The guarded quantities and their limits. One row per guarded quantity serves guard, --dry-run, live page and replay;
// of several limits on one quantity the tightest holds, and names its source.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daq/bench/bench.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// In the order of kQuantities. The first six: an axis of the load cell as it is read, its zero included.
enum class Watched : std::uint8_t {
  force_x,
  force_y,
  force_z,
  torque_x,
  torque_y,
  torque_z,
  thrust,
  shaft_torque,
  speed,
  speed_error,
  supply_current,
  output_current,
  motor_current,
  supply_voltage_low,
  supply_voltage_high,
  coil_temperature,
  load_cell_age,
  motor_age,
  supply_age,
  pause,
  recorder_pause,
  samples_missing,  ///< s of the load cell's stream in a row, while the motor turns; this and those below have no row
  frozen,           ///< an axis of the load cell repeats one value that its noise cannot repeat
  no_thrust,        ///< no thrust, or of the wrong sign, at a speed that gives some
  sleep,            ///< of this computer, however short
  state,            ///< no quantity: trouble that a device reports
};
inline constexpr std::size_t kWatchedCount = static_cast<std::size_t>(Watched::samples_missing);

/// What reported a value or a failure.
enum class Source : std::uint8_t { load_cell, motor, supply, runner, computer, guard };

/// On which side of its limit a quantity is safe.
enum class Sense : std::uint8_t { upper, lower };

/// One guarded quantity, except how it is measured (observation.cpp) and how a device limits it (guard_limits.cpp).
struct GuardedQuantity {
  Watched watched;
  Source source;
  Sense sense;
  const char* name;                        ///< in messages and --dry-run
  const char* unit;                        ///< of value and limit
  const char* key;                         ///< on the live page, with its unit
  const char* label;                       ///< on the live page
  const char* next_move;                   ///< after a trip
  std::optional<profiles::Limit> limit{};  ///< under `limits:` in campaign and bench file, in `unit`
  double allowed = 1;                      ///< share of that limit
  const char* note = "";                   ///< added to the limit's source
};

inline constexpr const char* kCheckStand = "look at the stand before you continue";
inline constexpr const char* kCheckLoad = "check propeller, occlusion and load cell for damage and loose fastenings";
inline constexpr const char* kCheckRotor = "check for a blocked rotor, a loose propeller, a weak supply";
inline constexpr const char* kCheckShort = "check for a blocked rotor and a short circuit";
inline constexpr const char* kCheckVoltage = "check the supply, its leads and its limits";
inline constexpr const char* kCheckComputer =
    "close other programs, do not stop kphi with Ctrl-Z; `kphi devices --timing` shows how late this computer is";
inline constexpr const char* kCheckBox = "check the box's power and network cable: `kphi devices`";

inline constexpr double kOvershoot = 1.05;  ///< a closed loop overshoots a little on every step

using profiles::Limit;

inline constexpr std::array<GuardedQuantity, kWatchedCount> kQuantities{{
    {Watched::force_x, Source::load_cell, Sense::upper, "Fx", "N", "fx_n", "Fx", kCheckLoad},
    {Watched::force_y, Source::load_cell, Sense::upper, "Fy", "N", "fy_n", "Fy", kCheckLoad},
    {Watched::force_z, Source::load_cell, Sense::upper, "Fz", "N", "fz_n", "Fz", kCheckLoad},
    {Watched::torque_x, Source::load_cell, Sense::upper, "Tx", "N m", "tx_nm", "Tx", kCheckLoad},
    {Watched::torque_y, Source::load_cell, Sense::upper, "Ty", "N m", "ty_nm", "Ty", kCheckLoad},
    {Watched::torque_z, Source::load_cell, Sense::upper, "Tz", "N m", "tz_nm", "Tz", kCheckLoad},
    // Either sign, zero subtracted; so is the torque about the thrust axis.
    {Watched::thrust, Source::load_cell, Sense::upper, "thrust", "N", "thrust_n", "Thrust", kCheckLoad,
     Limit("thrust_max_n")},
    {Watched::shaft_torque, Source::load_cell, Sense::upper, "torque about the shaft", "N m", "torque_nm",
     "Shaft torque", kCheckLoad, Limit("torque_max_nm")},
    {Watched::speed, Source::motor, Sense::upper, "speed", "RPM", "speed_rpm", "Speed", kCheckRotor,
     Limit("speed_max_rpm"), kOvershoot, ", 5 % overshoot allowed"},
    // Share of the command, in addition to 20 rad/s: see speed_error.hpp.
    {Watched::speed_error, Source::motor, Sense::upper, "speed error", "%", "speed_error_percent", "Speed error",
     kCheckStand, Limit("speed_error_max_percent")},
    // Into the motor module, as the module measures it.
    {Watched::supply_current, Source::motor, Sense::upper, "supply current", "A", "module_a", "Module current",
     kCheckShort, Limit("supply_current_max_a")},
    // Out of the bench supply, as the supply measures it.
    {Watched::output_current, Source::supply, Sense::upper, "output current of the supply", "A", "supply_a",
     "Supply current", kCheckShort, Limit("supply_current_max_a")},
    {Watched::motor_current, Source::motor, Sense::upper, "motor current", "A", "motor_a", "Motor current",
     kCheckShort},
    {Watched::supply_voltage_low, Source::motor, Sense::lower, "supply voltage", "V", "voltage_low_v", "Voltage",
     kCheckVoltage, Limit("supply_voltage_min_v")},
    // Of the module or of the bench supply.
    {Watched::supply_voltage_high, Source::motor, Sense::upper, "supply voltage", "V", "voltage_high_v", "Voltage",
     kCheckVoltage, Limit("supply_voltage_max_v")},
    {Watched::coil_temperature, Source::motor, Sense::upper, "coil temperature", "°C", "coil_degc", "Coil",
     "let the motor cool; add limits.cooling to the campaign, or use shorter steps",
     Limit("coil_temperature_max_degc")},
    // Wall time, while the motor turns; likewise the next four.
    {Watched::load_cell_age, Source::load_cell, Sense::upper, "age of the newest load-cell sample", "s",
     "load_cell_age_s", "Cell silent", kCheckBox},
    {Watched::motor_age, Source::motor, Sense::upper, "age of the newest motor reading", "s", "motor_age_s",
     "Motor silent", "check the motor's cable and power: `kphi devices`"},
    {Watched::supply_age, Source::supply, Sense::upper, "age of the newest supply reading", "s", "supply_age_s",
     "Supply silent", "check the supply's cable: `kphi devices`"},
    {Watched::pause, Source::runner, Sense::upper, "pause of kphi", "s", "pause_s", "Program silent",
     "close other programs; do not stop kphi with Ctrl-Z"},
    {Watched::recorder_pause, Source::runner, Sense::upper, "pause of the recorder", "s", "recorder_pause_s",
     "Recorder silent", "check the disk under --out: is it full, slow, or on a network?"},
}};
static_assert(
    [] {
      for (std::size_t i = 0; i < kQuantities.size(); ++i) {
        if (kQuantities[i].watched != static_cast<Watched>(i)) return false;
      }
      return true;
    }(),
    "kQuantities has one row per Watched, in its order");
static_assert(
    [] {
      std::array<bool, profiles::kLimitKeys.size()> guards{};
      for (const GuardedQuantity& row : kQuantities)
        if (row.limit) guards[row.limit->index] = true;
      return std::ranges::find(guards, false) == guards.end();
    }(),
    "a limit that a file may set has no row in kQuantities");

[[nodiscard]] constexpr const GuardedQuantity& row_of(Watched watched) {
  return kQuantities[static_cast<std::size_t>(watched)];
}
[[nodiscard]] constexpr bool is_load_cell_axis(Watched watched) { return watched <= Watched::torque_z; }

struct GuardLimit {
  Watched watched{};
  std::string name;
  double value = 0;
  std::string unit;
  std::string source;  ///< "campaign limits.thrust_max_n"
  bool lower = false;  ///< true: trips below it

  friend bool operator==(const GuardLimit&, const GuardLimit&) = default;
};

/// For nlohmann::json.
template <class Json>
void to_json(Json& json, const GuardLimit& limit) {
  json = {{"key", row_of(limit.watched).key},
          {"name", limit.name},
          {"unit", limit.unit},
          {"limit", limit.value},
          {"lower", limit.lower},
          {"source", limit.source}};
}

/// Limits that the devices reported when they were connected.
struct DeviceLimits {
  std::array<double, 6> load_cell_range{};  ///< N and N m; 0: unknown
  iq::AuditRecord motor;
  double supply_reading_s = 0;  ///< what the longest reading of the supply took, wall time; 0: unknown
};

/// Of a connected bench.
[[nodiscard]] DeviceLimits device_limits(Bench& bench);
/// Of a recorded run, from its header.
[[nodiscard]] DeviceLimits device_limits(const results::RunHeader& header);

/// In the order of Watched; a quantity without a limit has no row. Without `devices`: the limits of the files.
[[nodiscard]] std::vector<GuardLimit> combine_limits(const profiles::Campaign& campaign,
                                                     const profiles::BenchConfig& config,
                                                     const DeviceLimits* devices = nullptr);
/// The tightest limit of the files; 0: none.
[[nodiscard]] double limit_of_files(Watched watched, const profiles::Campaign& campaign,
                                    const profiles::BenchConfig& config);

/// "thrust                               above 20 N        campaign limits.thrust_max_n", one line per limit.
[[nodiscard]] std::vector<std::string> to_lines(const std::vector<GuardLimit>& limits);

/// "below 5 V", "above 20 N".
[[nodiscard]] std::string to_words(const GuardLimit& limit);

/// Share of the limit that `value` uses: 1 at the limit, more beyond it. Not finite: unknown.
[[nodiscard]] inline double share_of(const GuardLimit& limit, double value) {
  return limit.lower ? limit.value / value : value / limit.value;
}

inline constexpr double kRangeBorne = 1.1;  ///< share of a range of the load cell: beyond it the cell is in danger
/// A sanitizer makes a live bench many times slower; a bench in process has virtual time.
#ifdef KPHI_SANITIZED
inline constexpr bool kInstrumented = true;
#else
inline constexpr bool kInstrumented = false;
#endif
[[nodiscard]] inline bool is_slowed(const profiles::BenchConfig& config) {
  return kInstrumented && !(config.simulation && config.simulation->in_process);
}
/// Oldest sample or reading while the motor turns, wall time. Checked twice: after this computer was blocked, the guard
/// takes what waits in the sockets in between.
[[nodiscard]] inline Duration spin_patience(const profiles::BenchConfig& config) {
  return std::chrono::milliseconds(is_slowed(config) ? 500 : 145);
}

}  // namespace kphi::daq
