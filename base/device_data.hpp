// What the devices of a bench deliver: samples, readings, events and counts. From the driver that takes them to the run
// file, column by column, they are the same plain values.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "base/clock.hpp"

namespace kphi {

/// Whether numbers come from devices or from a simulator: no output of kphi loses it.
enum class Origin : std::uint8_t { unknown, measured, simulated };
inline constexpr std::array<const char*, 3> kOriginNames{"unknown", "measured", "simulated"};
[[nodiscard]] constexpr const char* name_of(Origin origin) { return kOriginNames[static_cast<std::size_t>(origin)]; }
/// Of that name; unknown for any other.
[[nodiscard]] constexpr Origin origin_named(std::string_view name) {
  for (const Origin origin : {Origin::measured, Origin::simulated})
    if (name == name_of(origin)) return origin;
  return Origin::unknown;
}

/// Of several: simulated if one is, measured if all are.
[[nodiscard]] constexpr Origin together(Origin one, Origin other) {
  if (one == Origin::simulated || other == Origin::simulated) return Origin::simulated;
  return one == other ? one : Origin::unknown;
}

/// Nanoseconds of bench time since the clock's epoch: an Instant or a Duration as it is stored.
using Nanoseconds = std::int64_t;

/// Of the load cell.
inline constexpr std::array<const char*, 6> kAxisNames{"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};

/// One Net Box sample as it came, with the stamp of the datagram that brought it.
struct LoadCellRecord {
  std::array<std::int32_t, 6> counts{};  ///< Fx Fy Fz Tx Ty Tz
  std::uint32_t rdt_sequence = 0;        ///< place in this stream, 1 at each start, wraps
  std::uint32_t ft_sequence = 0;         ///< internal sample number since power-up, wraps
  std::uint32_t status = 0;              ///< word of the box (drivers/netbox/wire/status.hpp)
  Nanoseconds arrival_ns = 0;

  [[nodiscard]] Instant arrival() const noexcept { return Instant(arrival_ns); }
  friend bool operator==(const LoadCellRecord&, const LoadCellRecord&) = default;
};

/// What the motor module reports. One time series each in the run file, named as in kMotorChannels.
enum class MotorChannel : std::uint8_t {
  speed,             ///< rad/s, positive counter-clockwise
  supply_voltage,    ///< V
  supply_current,    ///< A
  motor_current,     ///< A, the module's estimate
  coil_temperature,  ///< °C
  derate,            ///< 1 = none; below 1 the module holds its voltage back and a speed is not to be trusted
  drive_mode,        ///< code; 5 = coast
  drive_pwm,         ///< share of the supply voltage that drives the motor, after all limits; -1..1
  fault_now,         ///< bits of what is wrong; 0 = nothing
};

struct MotorChannelInfo {
  MotorChannel channel;
  const char* name;  ///< the group's name in the file
  const char* unit;  ///< UDUNITS spelling
  const char* long_name;
};

inline constexpr std::array<MotorChannelInfo, 9> kMotorChannels{{
    {MotorChannel::speed, "speed", "rad s-1", "rotor speed, positive counter-clockwise"},
    {MotorChannel::supply_voltage, "supply_voltage", "V", "voltage at the module's input"},
    {MotorChannel::supply_current, "supply_current", "A", "current into the module"},
    {MotorChannel::motor_current, "motor_current", "A", "motor current, estimated by the module"},
    {MotorChannel::coil_temperature, "coil_temperature", "degC", "coil temperature, estimated by the module"},
    {MotorChannel::derate, "derate", "1", "drive derating factor, 1 = none"},
    {MotorChannel::drive_mode, "drive_mode", "1", "drive mode code, 5 = coast"},
    {MotorChannel::drive_pwm, "drive_pwm", "1", "share of the supply voltage that drives the motor"},
    {MotorChannel::fault_now, "fault_now", "1", "bits of power_safety.fault_now, 0 = no fault"},
}};

[[nodiscard]] constexpr const char* name_of(MotorChannel channel) {
  return kMotorChannels[static_cast<std::size_t>(channel)].name;
}

struct MotorReading {
  MotorChannel channel{};
  Nanoseconds time_ns = 0;         ///< midpoint of request and reply, less the time of their bytes on the wire
  Nanoseconds uncertainty_ns = 0;  ///< half of what is left between the two: the true moment is time ± uncertainty
  double value = 0;                ///< unit of the channel; always finite
};

/// The quantity that the supply regulates.
enum class SupplyRegulation : std::uint32_t { constant_voltage, constant_current, unknown };
inline constexpr std::array<const char*, 3> kSupplyRegulationNames{"constant voltage", "constant current", "unknown"};

/// Why the supply switched its output off by itself.
enum class SupplyProtection : std::uint32_t {
  none,
  over_voltage,
  over_current,
  over_power,
  over_temperature,
  short_circuit,
  unknown,  ///< with a code that is not documented
};
inline constexpr std::array<const char*, 7> kSupplyProtectionNames{
    "none", "over-voltage", "over-current", "over-power", "over-temperature", "short circuit", "unknown"};
[[nodiscard]] constexpr const char* name_of(SupplyProtection protection) {
  return kSupplyProtectionNames[static_cast<std::size_t>(protection)];
}

/// The keys of a supply while it is asked; said_free: it says so, though its maker's own firmware locks them.
enum class SupplyKeypad : std::uint8_t { free, locked, said_free };

/// One reading of the bench supply. Codes are those of the run file. A trip or a period of constant current between two
/// readings is not seen.
struct SupplyReading {
  Nanoseconds time_ns = 0;         ///< midpoint of request and answer
  Nanoseconds uncertainty_ns = 0;  ///< half of the time between the two: the true moment is time ± uncertainty
  double voltage_v = 0;            ///< at its terminals
  double current_a = 0;
  double set_voltage_v = 0;    ///< as the supply had it then: it may have been changed on the front panel
  double current_limit_a = 0;  ///< likewise
  SupplyRegulation regulation = SupplyRegulation::unknown;
  SupplyProtection protection = SupplyProtection::none;
  std::uint64_t output = 0;  ///< 1: on

  /// The product of what was measured; the supplies' own power registers have disputed scales.
  [[nodiscard]] double power_w() const noexcept { return voltage_v * current_a; }
};

/// What happened to the load cell's stream, to the cell, or to the motor module. Codes and names as in the run file.
enum class EventKind : std::uint8_t {
  restarted,              ///< rdt_sequence restarted, ft_sequence continued: a repeated or another client's start
  rebooted,               ///< ft_sequence restarted: bias and scale may have changed
  stalled,                ///< new records repeat one measurement
  stall_ended,            ///< `records` were repeated
  silent,                 ///< no record for longer than the silence timeout
  resumed,                ///< records arrive again after a silence
  box_trouble,            ///< status bit 20 (RDT) or 22 (network) was set: the box reports failed communication
  taken_over,             ///< silence, but the box answers and RDT is enabled: another client has the stream
  rdt_disabled,           ///< silence, and RDT is disabled on the box
  unreachable,            ///< silence, and the box does not answer over HTTP either
  near_range,             ///< an axis above 80 % of its range; the first time in a run
  beyond_range,           ///< at 100 % or more; the first time in a run
  range_trip,             ///< above 110 %: the motor was let go
  unusable,               ///< silent or booted, and now set so that nothing can be measured with it
  reconnected,            ///< started again after a silence
  configuration_changed,  ///< its counts mean something else since then
  given_up,               ///< no reconnection in time
  motor_connected,        ///< found again; it coasts, and turns no more in this run
  motor_no_answer,        ///< could not be connected to
  motor_reset,            ///< it restarted by itself
  motor_silent,           ///< it stopped answering
  motor_coast_denied,     ///< it did not confirm that it coasts
  motor_lease_expired,    ///< the command was not renewed in time, and the driver let the motor coast
  motor_port_lost,        ///< unplugged
  motor_another_module,   ///< another one answers
  motor_slow_round_trip,  ///< its readings are blurred in time
  supply_stop,            ///< what the bench supply showed stopped the run
  guard_trip,             ///< a limit was passed or a stream fell silent: the motor was let go
  box_error,              ///< the box's status says that its samples cannot be trusted; the first time in a run
  box_error_ended,        ///< its status is sound again; `records` samples were concerned
  motor_host_absent,      ///< this computer slept, or did not run kphi; the motor was let go
  motor_let_go,           ///< the module stopped driving by itself
  sentinel_replaced,      ///< the process that would switch off after this program's death had died itself
};
inline constexpr std::array<const char*, 33> kEventNames{
    // the load cell and its stream
    "restarted", "rebooted", "stalled", "stall_ended", "silent", "resumed", "box_trouble", "taken_over", "rdt_disabled",
    "unreachable", "near_range", "beyond_range", "range_trip", "unusable", "reconnected", "configuration_changed",
    "given_up",
    // the motor module
    "motor_connected", "motor_no_answer", "motor_reset", "motor_silent", "motor_coast_denied", "motor_lease_expired",
    "motor_port_lost", "motor_another_module", "motor_slow_round_trip",
    // supply and guard; then what came later
    "supply_stop", "guard_trip", "box_error", "box_error_ended", "motor_host_absent", "motor_let_go",
    "sentinel_replaced"};
[[nodiscard]] constexpr const char* name_of(EventKind kind) { return kEventNames[static_cast<std::size_t>(kind)]; }

/// Of the motor module; else of the load cell, the supply, the guard or the sentinel.
[[nodiscard]] constexpr bool is_of_motor(EventKind kind) {
  return (kind >= EventKind::motor_connected && kind <= EventKind::motor_slow_round_trip) ||
         kind == EventKind::motor_host_absent || kind == EventKind::motor_let_go;
}
/// Of the motor module, and no measurement across it is valid: the motor coasts already.
[[nodiscard]] constexpr bool ends_a_run(EventKind kind) {
  return is_of_motor(kind) && kind != EventKind::motor_connected && kind != EventKind::motor_slow_round_trip;
}

struct StreamEvent {
  EventKind kind{};
  Nanoseconds time_ns = 0;
  std::uint64_t records = 0;  ///< missing before it; of a stall: repeated; of a box error that ended: concerned
  std::string text;           ///< one line; the file holds results::kEventTextBytes of it
};

/// How many samples there should be and are. received + lost_network + lost_host = expected, exactly.
struct SampleAccount {
  std::uint64_t expected = 0;      ///< by ft_sequence, first to last
  std::uint64_t received = 0;      ///< in the file
  std::uint64_t lost_network = 0;  ///< never reached this computer; late ones stay counted here
  std::uint64_t lost_host = 0;     ///< dropped by the socket (SO_RXQ_OVFL) or a full queue
  std::uint64_t duplicates = 0;    ///< arrived a second time; discarded
  std::uint64_t late = 0;          ///< arrived after a younger one had been delivered; discarded
  std::uint64_t malformed = 0;     ///< datagrams of a wrong size
  std::uint64_t restarts = 0;      ///< of the stream
  std::uint64_t reboots = 0;       ///< of the box: ft_sequence began anew
  std::uint64_t reordered = 0;     ///< overtaken on the way; in their place again
  std::uint64_t stalled = 0;       ///< repeated an old measurement under a new rdt_sequence; discarded
  std::uint64_t irregular = 0;     ///< accepted, but the two sequences disagree about the gap before them
};

/// How well the stream did, first to last record. Rates in bench time, jitter in wall time.
struct StreamHealth {
  double records_per_second = 0;
  double datagrams_per_second = 0;
  double jitter_p50_s = 0;  ///< arrival after that of the least delayed datagram
  double jitter_p99_s = 0;
  double skew_ppm = 0;                 ///< box's clock slow: positive; 0 before it is known
  double clock_uncertainty_s = 0;      ///< without the constant part of the delay
  std::uint64_t queue_high_water = 0;  ///< records that waited for the recorder at most
  std::uint64_t events_dropped = 0;    ///< beyond what the lists hold
};

}  // namespace kphi
