// What a run leaves: plain records, the same in memory and (column by column) in the run file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace kphi::results {

/// Nanoseconds of bench time since the run's epoch.
using Nanoseconds = std::int64_t;

/// A stretch of bench time.
struct Window {
  Nanoseconds begin = 0;
  Nanoseconds end = 0;  ///< not in it

  [[nodiscard]] double centre() const { return 0.5 * (static_cast<double>(begin) + static_cast<double>(end)); }
  [[nodiscard]] double seconds() const { return 1e-9 * static_cast<double>(end - begin); }
};

/// One Net Box sample as it came, with the stamp of the datagram that brought it.
struct LoadCellRecord {
  std::array<std::int32_t, 6> counts{};  ///< Fx Fy Fz Tx Ty Tz
  std::uint32_t rdt_sequence = 0;
  std::uint32_t ft_sequence = 0;
  std::uint32_t status = 0;
  Nanoseconds arrival_ns = 0;
};

/// What the motor module reports. One time series each in the run file, named as in kMotorChannels.
enum class MotorChannel : std::uint8_t {
  speed,             ///< rad/s, positive counter-clockwise
  supply_voltage,    ///< V
  supply_current,    ///< A
  motor_current,     ///< A, the module's estimate
  coil_temperature,  ///< °C
  derate,            ///< 1 = none
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

struct MotorReading {
  MotorChannel channel{};
  Nanoseconds time_ns = 0;         ///< midpoint of request and reply
  Nanoseconds uncertainty_ns = 0;  ///< half the round trip
  double value = 0;                ///< unit of the channel
};

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
  unknown,
};
inline constexpr std::array<const char*, 7> kSupplyProtectionNames{
    "none", "over-voltage", "over-current", "over-power", "over-temperature", "short circuit", "unknown"};
[[nodiscard]] constexpr const char* name_of(SupplyProtection protection) {
  return kSupplyProtectionNames[static_cast<std::size_t>(protection)];
}

/// One reading of the bench supply. Codes are those of the run file.
struct SupplyReading {
  std::int64_t time_ns = 0;         ///< bench time, midpoint of request and answer
  std::int64_t uncertainty_ns = 0;  ///< half of the time between the two
  double voltage_v = 0;             ///< at its terminals
  double current_a = 0;
  double set_voltage_v = 0;    ///< as the supply had it then
  double current_limit_a = 0;  ///< likewise
  SupplyRegulation regulation = SupplyRegulation::unknown;
  SupplyProtection protection = SupplyProtection::none;
  std::uint64_t output = 0;  ///< 1: on
};

// At a settled speed: share of the set voltage that may be missing at the terminals, and share above it that is more
// than a meter errs by, so that the motor feeds back.
inline constexpr double kSupplySag = 0.05;
inline constexpr double kSupplyRise = 0.03;

/// What the runner asks for. Codes as in the run file. The box's own bias is taken before zero_before.
enum class Phase : std::uint8_t {
  zero_before,
  step,
  spin_down,
  zero_after,
  end,
  bias_before,    ///< measured without load
  bias_settling,  ///< the box was told to take the load as zero
  bias_after,     ///< measured again
  ramp,           ///< on the way to the speed of the next step, no faster than the campaign allows
};
inline constexpr std::array<const char*, 9> kPhaseNames{
    "zero before", "step", "spin down", "zero after", "end", "bias before", "bias settling", "bias after", "ramp"};

struct PhaseMark {
  Phase phase{};
  int step = -1;            ///< 0-based, -1 outside steps
  Nanoseconds time_ns = 0;  ///< begin of the phase
  double speed_rad_s = 0;   ///< commanded, unsigned
};

/// How counts become newtons: read from the box at the start of the run.
struct LoadCellScale {
  double counts_per_newton = 1e6;
  double counts_per_newton_metre = 1e6;
  double sample_rate_hz = 7000;   ///< nominal rate of records
  std::uint32_t ft_stride = 1;    ///< ft_sequence counts per record
  double device_rate_hz = 7000;   ///< rate at which ft_sequence counts
  std::array<double, 6> range{};  ///< N and N m
  /// Bits of the status word that say that the load is beyond what the cell can measure: they differ by product.
  std::uint32_t saturation_bits = 1u << 17;
  std::string serial;             ///< of the calibration
  std::string configuration_xml;  ///< verbatim
  std::string slots_json;         ///< pages of all slots, verbatim: {"netftapi2.xml?index=0": "<?xml …", …}
};

/// Everything about a run that is known before the motor turns.
struct RunHeader {
  std::string uuid;
  std::string started_utc;  ///< ISO 8601, Z
  std::string tool_version;
  std::string campaign_name;
  std::string campaign_text;
  std::string bench_text;
  std::string operator_name;
  std::string propeller_id;
  std::string propeller_name;
  double diameter_in = 0;
  int blades = 0;
  double occlusion_deg = 0;
  int repetition = 0;   ///< 1-based; negative: a reference run
  int thrust_axis = 2;  ///< 0..2
  int thrust_sign = +1;
  int spin = +1;
  double minimum_discard_s = 0;
  double supply_voltage_v = 0;           ///< that the campaign wants at the motor module; 0: not checked
  double coil_temperature_max_degc = 0;  ///< the campaign's limit; 0: not checked
  double clock_gain = 1;                 ///< true speed per speed that the motor module reports
  double clock_gain_u = 0;               ///< its standard uncertainty; 0: the gain was not measured
  LoadCellScale load_cell;
  std::string motor_identity;      ///< one line: firmware, hardware, uid
  std::string motor_parameters;    ///< YAML: what the module told of itself, one line each
  std::string supply_identity;     ///< one line: model, serial, firmware; empty: none
  double air_density_kg_m3 = 0;    ///< 0: unknown
  double air_density_u_kg_m3 = 0;  ///< its standard uncertainty
};

/// How many samples there should be and are. received + lost_network + lost_host = expected, exactly.
struct SampleAccount {
  std::uint64_t expected = 0;  ///< by ft_sequence, first to last
  std::uint64_t received = 0;  ///< in the file
  std::uint64_t lost_network = 0;
  std::uint64_t lost_host = 0;   ///< dropped by the socket (SO_RXQ_OVFL) or a full queue
  std::uint64_t duplicates = 0;  ///< discarded
  std::uint64_t late = 0;        ///< discarded
  std::uint64_t malformed = 0;   ///< datagrams of a wrong size
  std::uint64_t restarts = 0;    ///< of the stream
  std::uint64_t reboots = 0;     ///< of the box: ft_sequence began anew
  std::uint64_t reordered = 0;   ///< overtaken on the way; in their place again
  std::uint64_t stalled = 0;     ///< repeated an old measurement; discarded
  std::uint64_t irregular = 0;   ///< accepted, but the two sequences disagree about the gap before them
};

/// What happened to the load cell's stream, to the cell, or to the motor module. Codes and names as in the run file.
enum class EventKind : std::uint8_t {
  restarted,
  rebooted,
  stalled,
  stall_ended,
  silent,
  resumed,
  box_trouble,
  taken_over,
  rdt_disabled,
  unreachable,
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
};
inline constexpr std::array<const char*, 32> kEventNames{
    // the load cell and its stream
    "restarted", "rebooted", "stalled", "stall_ended", "silent", "resumed", "box_trouble", "taken_over", "rdt_disabled",
    "unreachable", "near_range", "beyond_range", "range_trip", "unusable", "reconnected", "configuration_changed",
    "given_up",
    // the motor module
    "motor_connected", "motor_no_answer", "motor_reset", "motor_silent", "motor_coast_denied", "motor_lease_expired",
    "motor_port_lost", "motor_another_module", "motor_slow_round_trip",
    // supply and guard; then what came later
    "supply_stop", "guard_trip", "box_error", "box_error_ended", "motor_host_absent", "motor_let_go"};
[[nodiscard]] constexpr const char* name_of(EventKind kind) { return kEventNames[static_cast<std::size_t>(kind)]; }

/// Of the motor module; else of the load cell, or of the supply.
[[nodiscard]] constexpr bool is_of_motor(EventKind kind) {
  return (kind >= EventKind::motor_connected && kind <= EventKind::motor_slow_round_trip) ||
         kind == EventKind::motor_host_absent || kind == EventKind::motor_let_go;
}

struct StreamEvent {
  EventKind kind{};
  Nanoseconds time_ns = 0;
  std::uint64_t records = 0;  ///< missing before it; of a stall: repeated; of a box error that ended: concerned
  std::string text;           ///< one line; the file holds kEventTextBytes of it
};
inline constexpr std::size_t kEventTextBytes = 240;

/// How well the stream did, first to last record. Rates in bench time, jitter as a person's clock runs.
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

/// What became of the questions to the motor module during the run: names as in the run file.
inline constexpr std::array<const char*, 9> kMotorCounts{
    "motor_requests",          // sent
    "motor_replies",           // used
    "motor_timeouts",          // no reply in time
    "motor_late_replies",      // after that; not used
    "motor_unasked",           // replies without a request
    "motor_crc_errors",        // frames with a bad CRC
    "motor_discarded_bytes",   // that belong to no frame
    "motor_skipped_polls",     // due while the same question was still open
    "motor_dropped_readings",  // not taken in time by this computer
};
using MotorCounts = std::array<std::uint64_t, kMotorCounts.size()>;

/// The box's own bias (0x42), measured without load before and after it was taken. Apart from the zeros of the run,
/// which are subtracted by software. Fx Fy Fz in N, Tx Ty Tz in N m.
struct BoxBias {
  std::uint64_t records = 0;  ///< of each mean; 0: no bias was taken
  std::array<double, 6> before{}, before_sd{};
  std::array<double, 6> after{}, after_sd{};
};

enum class Outcome : std::uint8_t { complete, aborted };

/// What is known at the end of a run.
struct RunEnding {
  Outcome outcome = Outcome::aborted;
  std::string outcome_reason;
  SampleAccount account;
  StreamHealth health;
  MotorCounts motor_counts{};
  BoxBias box_bias;
};

/// A run read back, whole.
struct RunRecording : RunEnding {
  RunHeader header;
  std::vector<LoadCellRecord> load_cell;
  std::vector<MotorReading> motor;    ///< sorted by channel, then time
  std::vector<SupplyReading> supply;  ///< by time
  std::vector<PhaseMark> phases;
  std::vector<StreamEvent> events;  ///< in the order in which they were noticed
};

}  // namespace kphi::results
