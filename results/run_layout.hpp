// The run file (README.md describes it): its columns and attributes, told once. Writer, reader, verification and the
// digest of the attributes go by these tables.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

#include "results/records.hpp"

namespace kphi::results {

inline constexpr const char* kRunFormat = "kphi-run/1";

/// How one row of a column lies in the file, little-endian. `counts`: six i32; `text`: kEventTextBytes of UTF-8, filled
/// up with zeros.
enum class Stored : std::uint8_t { u8, i32, u32, i64, u64, f64, counts, text };
using StoredText = std::array<char, kEventTextBytes>;

[[nodiscard]] constexpr std::size_t bytes_of(Stored stored) {
  constexpr std::array<std::size_t, 8> kBytes{1, 4, 4, 8, 8, 8, 24, kEventTextBytes};
  return kBytes[static_cast<std::size_t>(stored)];
}

struct ColumnLayout {
  const char* name;
  const char* unit;  ///< UDUNITS spelling; nullptr: unit and long name are those of the group
  const char* long_name;
  Stored stored;
  std::span<const char* const> codes{};  ///< what each code means; empty: a plain number
};

template <class Row>
struct RunColumn : ColumnLayout {
  void (*pack)(std::span<const Row> rows, std::byte* out);
  void (*unpack)(const std::byte* in, std::span<Row> rows);
};

/// Columns that grow together. The one named `time` is the scale of all others.
template <class Row>
struct RunGroup {
  const char* name;
  const char* long_name;
  std::size_t chunk_rows;
  const char* time;
  std::span<const RunColumn<Row>> columns;
  const char* unit = "1";
};

namespace layout {

template <class Row, class Value>
Row row_type(Value Row::*);
template <class Row, class Value>
Value value_type(Value Row::*);

template <class Value>
using AsStored = std::conditional_t<std::is_enum_v<Value>, std::uint8_t,
                                    std::conditional_t<std::is_same_v<Value, std::string>, StoredText, Value>>;

template <class File>
[[nodiscard]] constexpr Stored stored_as() {
  if constexpr (std::is_same_v<File, std::uint8_t>) return Stored::u8;
  if constexpr (std::is_same_v<File, std::int32_t>) return Stored::i32;
  if constexpr (std::is_same_v<File, std::uint32_t>) return Stored::u32;
  if constexpr (std::is_same_v<File, std::int64_t>) return Stored::i64;
  if constexpr (std::is_same_v<File, std::uint64_t>) return Stored::u64;
  if constexpr (std::is_same_v<File, double> || std::is_same_v<File, std::array<double, 6>>) return Stored::f64;
  if constexpr (std::is_same_v<File, std::array<std::int32_t, 6>>) return Stored::counts;
  if constexpr (std::is_same_v<File, StoredText>) return Stored::text;
}

/// One member of a row; `File`: its type in the file.
template <auto member, class File = AsStored<decltype(value_type(member))>>
[[nodiscard]] constexpr auto column(const char* name, const char* unit, const char* long_name,
                                    std::span<const char* const> codes = {}) {
  using Row = decltype(row_type(member));
  using Value = decltype(value_type(member));
  const auto pack = [](std::span<const Row> rows, std::byte* out) {
    for (const Row& row : rows) {
      File file{};
      if constexpr (std::is_same_v<Value, std::string>) {
        (row.*member).copy(file.data(), file.size());
      } else {
        file = static_cast<File>(row.*member);
      }
      std::memcpy(out, &file, sizeof file);
      out += sizeof file;
    }
  };
  const auto unpack = [](const std::byte* in, std::span<Row> rows) {
    for (Row& row : rows) {
      File file{};
      std::memcpy(&file, in, sizeof file);
      in += sizeof file;
      if constexpr (std::is_same_v<Value, std::string>) {
        row.*member = std::string(file.data(), ::strnlen(file.data(), file.size()));
      } else {
        row.*member = static_cast<Value>(file);
      }
    }
  };
  return RunColumn<Row>{{name, unit, long_name, stored_as<File>(), codes}, pack, unpack};
}

inline constexpr std::array kLoadCell{
    column<&LoadCellRecord::counts>("counts", "count", "force and torque, Fx Fy Fz Tx Ty Tz"),
    column<&LoadCellRecord::rdt_sequence>("rdt_sequence", "1", "RDT sequence number"),
    column<&LoadCellRecord::ft_sequence>("ft_sequence", "1", "internal sample number of the box"),
    column<&LoadCellRecord::status>("status", "1", "status word of the box"),
    column<&LoadCellRecord::arrival_ns>("t_arrival_ns", "ns", "receive stamp of the datagram, bench time"),
};
/// Written when the run ends: the whole stream tells the clock of the box.
inline constexpr ColumnLayout kSampleTime{"t_ns", "ns", "time of the sample by the clock of the box, bench time",
                                          Stored::i64};
inline constexpr std::array kPlot{
    column<&PlotRow::time_s>("time", "s", "bench time"),
    column<&PlotRow::thrust_n>("thrust", "N", "thrust, zero subtracted"),
    column<&PlotRow::speed_rad_s>("speed", "rad s-1", "speed, positive in the direction of the spin"),
};
inline constexpr std::array kMotor{
    column<&MotorReading::value>("value", nullptr, "value of the channel"),
    column<&MotorReading::time_ns>("t_ns", "ns", "midpoint of request and reply, bench time"),
    column<&MotorReading::uncertainty_ns>("t_uncertainty_ns", "ns", "half the round trip"),
};
inline constexpr std::array kCommands{
    column<&PhaseMark::phase>("phase", "1", "phase", kPhaseNames),
    column<&PhaseMark::step>("step", "1", "number of the step from 0, -1 outside steps"),
    column<&PhaseMark::time_ns>("t_ns", "ns", "begin of the phase, bench time"),
    column<&PhaseMark::speed_rad_s>("speed_rad_s", "rad s-1", "commanded speed, unsigned"),
};
inline constexpr std::array kSupply{
    column<&SupplyReading::time_ns>("t_ns", "ns", "midpoint of request and answer, bench time"),
    column<&SupplyReading::uncertainty_ns>("t_uncertainty_ns", "ns", "half the round trip"),
    column<&SupplyReading::voltage_v>("voltage", "V", "voltage at the supply's terminals"),
    column<&SupplyReading::current_a>("current", "A", "current out of the supply"),
    column<&SupplyReading::set_voltage_v>("set_voltage", "V", "set voltage, as read back"),
    column<&SupplyReading::current_limit_a>("current_limit", "A", "current limit, as read back"),
    column<&SupplyReading::regulation>("regulation", "1", "regulation", kSupplyRegulationNames),
    column<&SupplyReading::protection>("protection", "1", "protection that switched it off", kSupplyProtectionNames),
    column<&SupplyReading::output, std::uint8_t>("output", "1", "1: on"),
};
inline constexpr std::array kEvents{
    column<&StreamEvent::kind>("kind", "1", "kind", kEventNames),
    column<&StreamEvent::time_ns>("t_ns", "ns", "when it was noticed, bench time"),
    column<&StreamEvent::records>("records", "1", "missing before it, or repeated"),
    column<&StreamEvent::text>("text", "1", "for a person"),
};

}  // namespace layout

inline constexpr std::size_t kSampleChunk = 8192;  // rows; a little over a second of the Net Box
inline constexpr std::size_t kReadingChunk = 1024;

inline constexpr RunGroup<LoadCellRecord> kLoadCellGroup{"load_cell", "Net Box records as received", kSampleChunk,
                                                         "t_arrival_ns", layout::kLoadCell};
inline constexpr RunGroup<PlotRow> kPlotGroup{"plot", "thrust and speed over time, means of 10 ms", kReadingChunk,
                                              "time", layout::kPlot};
inline constexpr RunGroup<PhaseMark> kCommandGroup{"commands", "what the runner asked for", 64, "t_ns",
                                                   layout::kCommands};
inline constexpr RunGroup<StreamEvent> kEventGroup{
    "events", "what happened to the load cell, its stream and the motor module", 16, "t_ns", layout::kEvents};
inline constexpr RunGroup<SupplyReading> kSupplyGroup{"supply", "readings of the bench supply; no rows without one",
                                                      kReadingChunk, "t_ns", layout::kSupply};
/// One group per channel, in the group `motor`.
[[nodiscard]] constexpr RunGroup<MotorReading> motor_group(const MotorChannelInfo& channel) {
  return {channel.name, channel.long_name, kReadingChunk, "t_ns", layout::kMotor, channel.unit};
}

/// Calls visit(name, member) for every root attribute that describes the run. `Header` is RunHeader or const RunHeader.
template <class Header, class Visit>
void for_each_attribute(Header& header, Visit&& visit) {
  if (!header.origin.empty()) visit("origin", header.origin);  // files of older versions have none
  visit("uuid", header.uuid);
  visit("started_utc", header.started_utc);
  visit("tool_version", header.tool_version);
  visit("campaign_name", header.campaign_name);
  visit("campaign_text", header.campaign_text);
  visit("bench_text", header.bench_text);
  visit("operator", header.operator_name);
  visit("propeller_id", header.propeller_id);
  visit("propeller_name", header.propeller_name);
  visit("diameter_in", header.diameter_in);
  visit("blades", header.blades);
  visit("occlusion_deg", header.occlusion_deg);
  visit("repetition", header.repetition);
  visit("thrust_axis", header.thrust_axis);
  visit("thrust_sign", header.thrust_sign);
  visit("spin", header.spin);
  visit("minimum_discard_s", header.minimum_discard_s);
  visit("supply_voltage_v", header.supply_voltage_v);
  visit("coil_temperature_max_degc", header.coil_temperature_max_degc);
  visit("clock_gain", header.clock_gain);
  visit("clock_gain_u", header.clock_gain_u);
  visit("counts_per_newton", header.load_cell.counts_per_newton);
  visit("counts_per_newton_metre", header.load_cell.counts_per_newton_metre);
  visit("sample_rate_hz", header.load_cell.sample_rate_hz);
  visit("ft_stride", header.load_cell.ft_stride);
  visit("device_rate_hz", header.load_cell.device_rate_hz);
  visit("range", header.load_cell.range);
  visit("saturation_bits", header.load_cell.saturation_bits);
  visit("calibration_serial", header.load_cell.serial);
  visit("configuration_xml", header.load_cell.configuration_xml);
  visit("slots_json", header.load_cell.slots_json);
  visit("motor_identity", header.motor_identity);
  visit("motor_parameters", header.motor_parameters);
  visit("supply_identity", header.supply_identity);
  visit("air_density_kg_m3", header.air_density_kg_m3);
  visit("air_density_u_kg_m3", header.air_density_u_kg_m3);
}

/// Calls visit(name, member) for every root attribute that is written at the end, but for the outcome. `Ending` is
/// RunEnding or const RunEnding.
template <class Ending, class Visit>
void for_each_figure(Ending& ending, Visit&& visit) {
  auto& account = ending.account;
  visit("n_expected", account.expected);
  visit("n_received", account.received);
  visit("n_lost_network", account.lost_network);
  visit("n_lost_host", account.lost_host);
  visit("n_duplicates", account.duplicates);
  visit("n_late", account.late);
  visit("n_malformed", account.malformed);
  visit("n_restarts", account.restarts);
  visit("n_reboots", account.reboots);
  visit("n_reordered", account.reordered);
  visit("n_stalled", account.stalled);
  visit("n_irregular", account.irregular);
  auto& health = ending.health;
  visit("health_records_per_second", health.records_per_second);
  visit("health_datagrams_per_second", health.datagrams_per_second);
  visit("health_jitter_p50_s", health.jitter_p50_s);
  visit("health_jitter_p99_s", health.jitter_p99_s);
  visit("health_skew_ppm", health.skew_ppm);
  visit("health_clock_uncertainty_s", health.clock_uncertainty_s);
  visit("health_queue_high_water", health.queue_high_water);
  visit("health_events_dropped", health.events_dropped);
  for (std::size_t i = 0; i < kMotorCounts.size(); ++i) visit(kMotorCounts[i], ending.motor_counts[i]);
  auto& bias = ending.box_bias;
  visit("box_bias_records", bias.records);
  visit("box_bias_before", bias.before);
  visit("box_bias_before_sd", bias.before_sd);
  visit("box_bias_after", bias.after);
  visit("box_bias_after_sd", bias.after_sd);
}

/// SHA-256 over names and values of all of these, with the outcome: what the attribute `attributes_sha256` holds.
[[nodiscard]] std::string attributes_digest(const RunHeader& header, const RunEnding& ending);

[[nodiscard]] const char* outcome_name(Outcome outcome);

}  // namespace kphi::results
