// What a run leaves: plain records, the same in memory and (column by column) in the run file.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "base/device_data.hpp"

namespace kphi::results {

/// A stretch of bench time.
struct Window {
  Nanoseconds begin = 0;
  Nanoseconds end = 0;  ///< not in it

  [[nodiscard]] double centre() const { return 0.5 * (static_cast<double>(begin) + static_cast<double>(end)); }
  [[nodiscard]] double seconds() const { return 1e-9 * static_cast<double>(end - begin); }
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
  std::string
      slots_json;  ///< page of the calibration, verbatim: {"netftcalapi.xml?index=0": "<?xml …"}; older files: of all
};

/// Everything about a run that is known before the motor turns.
struct RunHeader {
  std::string origin;  ///< name of an Origin; empty in the files of older versions
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
  double coil_temperature_max_degc = 0;  ///< the limit of the files; 0: not checked
  double clock_gain = 1;                 ///< true speed per speed that the motor module reports
  double clock_gain_u = 0;               ///< its standard uncertainty; 0: the gain was not measured
  LoadCellScale load_cell;
  std::string motor_identity;      ///< one line: firmware, hardware, uid
  std::string motor_parameters;    ///< YAML: what the module told of itself, one line each
  std::string supply_identity;     ///< one line: model, serial, firmware; empty: none
  double air_density_kg_m3 = 0;    ///< 0: unknown
  double air_density_u_kg_m3 = 0;  ///< its standard uncertainty
};

inline constexpr std::size_t kEventTextBytes = 240;

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
  std::string contents_xxh128;      ///< of what the quick read_run() reads; empty: read otherwise, or never ended
};

/// How a run is known again.
struct RunDigests {
  std::string sha256;           ///< of its file
  std::string contents_xxh128;  ///< of what a reduction reads of it; empty in the journals of older versions
};

/// A row of the group /plot.
struct PlotRow {
  double time_s = 0;       ///< bench time
  double thrust_n = 0;     ///< zero subtracted; NaN: no samples
  double speed_rad_s = 0;  ///< NaN: no reading before it, or none after it
};

/// What a finished run file holds for readers that do not have kphi's clock.
struct RunViews {
  std::vector<Nanoseconds> sample_times;  ///< bench time of each load-cell record; empty: not written
  std::vector<PlotRow> plot;              ///< empty: not written
};

}  // namespace kphi::results
