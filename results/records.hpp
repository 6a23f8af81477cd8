// What a run leaves: plain records, the same in memory and (column by column) in the run file.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace kphi::results {

/// Nanoseconds of bench time since the run's epoch.
using Nanoseconds = std::int64_t;

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
};

struct MotorChannelInfo {
  MotorChannel channel;
  const char* name;  ///< the group's name in the file
  const char* unit;  ///< UDUNITS spelling
  const char* long_name;
};

inline constexpr std::array<MotorChannelInfo, 7> kMotorChannels{{
    {MotorChannel::speed, "speed", "rad s-1", "rotor speed, positive counter-clockwise"},
    {MotorChannel::supply_voltage, "supply_voltage", "V", "voltage at the module's input"},
    {MotorChannel::supply_current, "supply_current", "A", "current into the module"},
    {MotorChannel::motor_current, "motor_current", "A", "motor current, estimated by the module"},
    {MotorChannel::coil_temperature, "coil_temperature", "degC", "coil temperature, estimated by the module"},
    {MotorChannel::derate, "derate", "1", "drive derating factor, 1 = none"},
    {MotorChannel::drive_mode, "drive_mode", "1", "drive mode code, 5 = coast"},
}};

struct MotorReading {
  MotorChannel channel{};
  Nanoseconds time_ns = 0;         ///< midpoint of request and reply
  Nanoseconds uncertainty_ns = 0;  ///< half the round trip
  double value = 0;                ///< unit of the channel
};

/// What the runner asked for, and when the motor was told.
enum class Phase : std::uint8_t { zero_before, step, spin_down, zero_after, end };

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
  std::string serial;             ///< of the calibration
  std::string configuration_xml;  ///< verbatim
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
  int repetition = 0;   ///< 1-based
  int thrust_axis = 2;  ///< 0..2
  int thrust_sign = +1;
  int spin = +1;
  double minimum_discard_s = 0;
  LoadCellScale load_cell;
  std::string motor_identity;  ///< one line: firmware, hardware, uid
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
};

enum class Outcome : std::uint8_t { complete, aborted };

/// A run read back, whole.
struct RunRecording {
  RunHeader header;
  SampleAccount account;
  Outcome outcome = Outcome::aborted;
  std::string outcome_reason;
  std::vector<LoadCellRecord> load_cell;
  std::vector<MotorReading> motor;  ///< sorted by channel, then time
  std::vector<PhaseMark> phases;
};

}  // namespace kphi::results
