#include "daq/guard/guard_limits.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>

#include "daq/guard/speed_error.hpp"

namespace kphi::daq {
namespace {

constexpr double kSupplyPatience = 2;    // s; the supply is read eight times per second, or as fast as it answers
constexpr double kLongestPause = 0.4;    // s; the driver coasts the motor after 0.5 s
constexpr double kRecorderPause = 5;     // s; what arrives meanwhile waits in memory, for at most 10 s
constexpr double kMeterOfSupply = 1.02;  // a supply that limits its current shows a little more than its limit

/// The tightest limit that was offered for each quantity.
using Table = std::map<Watched, GuardLimit>;

/// Ignores a value that is missing or not a positive, finite number.
void offer(Table& table, Watched watched, const std::optional<double>& value, const std::string& source) {
  if (!value || !std::isfinite(*value) || *value <= 0) return;
  const GuardedQuantity& row = row_of(watched);
  const bool lower = row.sense == Sense::lower;
  const auto have = table.find(watched);
  if (have == table.end() || (lower ? *value > have->second.value : *value < have->second.value))
    table[watched] = {watched, row.name, *value, row.unit, source, lower};
}

/// `file`: "campaign" or "bench".
void offer_file(Table& table, const char* file, const profiles::Limits& limits) {
  for (const GuardedQuantity& row : kQuantities) {
    const std::optional<double> value = row.limit ? limits[*row.limit] : std::nullopt;
    if (value)
      offer(table, row.watched, row.allowed * *value,
            fmt::format("{} limits.{}{}", file, profiles::kLimitKeys[row.limit->index], row.note));
  }
}

void offer_bench(Table& table, const profiles::BenchConfig& config) {
  offer(table, Watched::speed, kOvershoot * to_rpm(config.iq.speed_max),
        "bench iq.speed_max_rpm, 5 % overshoot allowed");
  if (!config.supply) return;
  offer(table, Watched::supply_voltage_high, config.supply->over_voltage.value(), "bench supply.over_voltage_v");
  offer(table, Watched::output_current, kMeterOfSupply * config.supply->over_current.value(),
        "bench supply.over_current_a, 2 % for its meter");
}

void offer_devices(Table& table, const DeviceLimits& devices) {
  for (std::size_t axis = 0; axis < 6; ++axis)
    offer(table, static_cast<Watched>(axis), kRangeBorne * devices.load_cell_range[axis],
          "device load cell, 110 % of its range");
  const iq::AuditRecord& motor = devices.motor;
  const auto of_motor = [&](Watched watched, const std::optional<double>& value, const char* entry) {
    offer(table, watched, value, std::string("device motor ") + entry);
  };
  auto redline_rpm = motor.value<"brushless_drive.motor_redline_start">();
  if (redline_rpm) *redline_rpm /= kRadPerSecPerRpm;
  of_motor(Watched::speed, redline_rpm, "brushless_drive.motor_redline_start");
  of_motor(Watched::supply_current, motor.value<"power_safety.current_input_high">(),
           "power_safety.current_input_high");
  of_motor(Watched::motor_current, motor.value<"power_safety.motor_current_high">(), "power_safety.motor_current_high");
  of_motor(Watched::supply_voltage_low, motor.value<"power_safety.volt_input_low">(), "power_safety.volt_input_low");
  of_motor(Watched::supply_voltage_high, motor.value<"power_safety.volt_input_high">(), "power_safety.volt_input_high");
  of_motor(Watched::coil_temperature, motor.value<"power_safety.temperature_coil_high">(),
           "power_safety.temperature_coil_high");
  of_motor(Watched::coil_temperature, motor.value<"coil_temperature_estimator.otw">(),
           "coil_temperature_estimator.otw");
}

/// A slow supply's reading is that old when the next one is there.
double patience_with_supply(const DeviceLimits* devices) {
  return std::max(kSupplyPatience, 1 + 2 * (devices != nullptr ? devices->supply_reading_s : 0));
}

/// Limits that neither a file nor a device sets.
void offer_own(Table& table, const profiles::BenchConfig& config, const DeviceLimits* devices) {
  offer(table, Watched::speed_error, 100 * SpeedWatch::kShare, "kphi");
  offer(table, Watched::load_cell_age, to_seconds(spin_patience(config)), "kphi, while the motor turns");
  offer(table, Watched::motor_age, to_seconds(spin_patience(config)), "kphi, while the motor turns");
  const double patience_s = patience_with_supply(devices);
  if (config.supply)
    offer(table, Watched::supply_age, patience_s,
          patience_s > kSupplyPatience ? fmt::format("kphi; a reading takes {:.1f} s", devices->supply_reading_s)
                                       : "kphi");
  offer(table, Watched::pause, kLongestPause, "kphi, while the motor turns");
  offer(table, Watched::recorder_pause, kRecorderPause, "kphi, while the motor turns");
}

}  // namespace

DeviceLimits device_limits(Bench& bench) {
  const SupplyLink* const supply = bench.supply();
  const Duration reading = supply != nullptr ? supply->longest_reading() : Duration(0);
  return {bench.load_cell().scale().range, bench.motor().parameters(), to_seconds(bench.clock().shrunk(reading))};
}

DeviceLimits device_limits(const results::RunHeader& header) {
  return {header.load_cell.range, iq::AuditRecord::of(header.motor_parameters)};
}

std::vector<GuardLimit> combine_limits(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                                       const DeviceLimits* devices) {
  Table table;
  offer_file(table, "campaign", campaign.limits);
  offer_file(table, "bench", config.limits);
  offer_bench(table, config);
  if (devices != nullptr) offer_devices(table, *devices);
  offer_own(table, config, devices);
  std::vector<GuardLimit> limits;
  for (const auto& [watched, limit] : table)
    if (config.supply || row_of(watched).source != Source::supply) limits.push_back(limit);
  return limits;
}

double limit_of_files(Watched watched, const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  for (const GuardLimit& limit : combine_limits(campaign, config))
    if (limit.watched == watched) return limit.value;
  return 0;
}

std::string to_words(const GuardLimit& limit) {
  const char* way = limit.lower ? "below" : "above";
  if (limit.unit == "RPM") return fmt::format("{} {:.0f} RPM", way, limit.value);
  return fmt::format("{} {:.4g} {}", way, limit.value, limit.unit);
}

std::vector<std::string> to_lines(const std::vector<GuardLimit>& limits) {
  std::vector<std::string> lines;
  for (const GuardLimit& limit : limits)
    lines.push_back(fmt::format("{:<35}  {:<16}  {}", limit.name, to_words(limit), limit.source));
  return lines;
}

}  // namespace kphi::daq
