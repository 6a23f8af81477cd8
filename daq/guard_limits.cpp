#include "daq/guard_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daq/speed_error.hpp"

namespace kphi::daq {
namespace {

constexpr double kSupplyPatience = 2;    // s; it is asked eight times per second
constexpr double kLongestPause = 0.4;    // s; the driver lets the motor coast after 0.5 s
constexpr double kMeterOfSupply = 1.02;  // a supply that limits its current shows a little more than its limit

struct WatchedInfo {
  Watched watched;
  const char* name;
  const char* unit;
};
constexpr WatchedInfo kWatched[] = {
    {Watched::force_x, "Fx", "N"},
    {Watched::force_y, "Fy", "N"},
    {Watched::force_z, "Fz", "N"},
    {Watched::torque_x, "Tx", "N m"},
    {Watched::torque_y, "Ty", "N m"},
    {Watched::torque_z, "Tz", "N m"},
    {Watched::thrust, "thrust", "N"},
    {Watched::shaft_torque, "torque about the shaft", "N m"},
    {Watched::speed, "speed", "RPM"},
    {Watched::speed_error, "speed error", "%"},
    {Watched::supply_current, "supply current", "A"},
    {Watched::output_current, "output current of the supply", "A"},
    {Watched::motor_current, "motor current", "A"},
    {Watched::supply_voltage_low, "supply voltage", "V"},
    {Watched::supply_voltage_high, "supply voltage", "V"},
    {Watched::coil_temperature, "coil temperature", "°C"},
    {Watched::load_cell_age, "age of the newest load-cell sample", "s"},
    {Watched::motor_age, "age of the newest motor reading", "s"},
    {Watched::supply_age, "age of the newest supply reading", "s"},
    {Watched::pause, "pause of kphi", "s"},
};

/// One row for each quantity, the tightest that was offered.
class Table {
 public:
  /// Nothing and what is no positive number: no limit.
  void offer(Watched watched, const std::optional<double>& value, const std::string& source) {
    if (!value || !std::isfinite(*value) || *value <= 0) return;
    const WatchedInfo& info = kWatched[static_cast<std::size_t>(watched)];
    const bool lower = watched == Watched::supply_voltage_low;
    const GuardLimit row{watched, info.name, *value, info.unit, source, lower};
    auto& have = rows_[static_cast<std::size_t>(watched)];
    if (!have || (lower ? *value > have->value : *value < have->value)) have = row;
  }
  [[nodiscard]] std::vector<GuardLimit> rows() const {
    std::vector<GuardLimit> rows;
    for (const auto& row : rows_) {
      if (row) rows.push_back(*row);
    }
    return rows;
  }

 private:
  std::array<std::optional<GuardLimit>, std::size(kWatched)> rows_;
};

std::optional<double> scaled(const std::optional<double>& value, double factor) {
  return value ? std::optional(factor * *value) : std::nullopt;
}

void offer_campaign(Table& table, const profiles::Limits& limits) {
  const auto key = [](const char* name) { return std::string("campaign limits.") + name; };
  const auto plain = [](const auto& quantity) {
    return quantity ? std::optional(quantity->value()) : std::optional<double>();
  };
  table.offer(Watched::thrust, limits.thrust_max.value(), key("thrust_max_n"));
  table.offer(Watched::shaft_torque, plain(limits.torque_max), key("torque_max_nm"));
  table.offer(Watched::speed, kOvershoot * to_rpm(limits.speed_max), key("speed_max_rpm") + ", 5 % overshoot borne");
  table.offer(Watched::speed_error, scaled(limits.speed_error_max, 100), key("speed_error_max_percent"));
  table.offer(Watched::supply_current, limits.supply_current_max.value(), key("supply_current_max_a"));
  table.offer(Watched::output_current, limits.supply_current_max.value(), key("supply_current_max_a"));
  table.offer(Watched::supply_voltage_low, plain(limits.supply_voltage_min), key("supply_voltage_min_v"));
  table.offer(Watched::supply_voltage_high, plain(limits.supply_voltage_max), key("supply_voltage_max_v"));
  table.offer(Watched::coil_temperature, limits.coil_temperature_max.value(), key("coil_temperature_max_degc"));
}

void offer_bench(Table& table, const profiles::Bench& place) {
  table.offer(Watched::speed, kOvershoot * to_rpm(place.iq.speed_max), "bench iq.speed_max_rpm, 5 % overshoot borne");
  if (!place.supply) return;
  table.offer(Watched::supply_voltage_high, place.supply->over_voltage.value(), "bench supply.over_voltage_v");
  table.offer(Watched::output_current, kMeterOfSupply * place.supply->over_current.value(),
              "bench supply.over_current_a, 2 % for its meter");
}

void offer_devices(Table& table, const DeviceLimits& devices) {
  for (std::size_t axis = 0; axis < 6; ++axis)
    table.offer(static_cast<Watched>(axis), kRangeBorne * devices.load_cell_range[axis],
                "device load cell, 110 % of its range");
  const iq::AuditRecord& motor = devices.motor;
  const auto offer = [&](Watched watched, const std::optional<double>& value, const char* entry) {
    table.offer(watched, value, std::string("device motor ") + entry);
  };
  offer(Watched::speed, scaled(motor.value<"brushless_drive.motor_redline_start">(), 1 / kRadPerSecPerRpm),
        "brushless_drive.motor_redline_start");
  offer(Watched::supply_current, motor.value<"power_safety.current_input_high">(), "power_safety.current_input_high");
  offer(Watched::motor_current, motor.value<"power_safety.motor_current_high">(), "power_safety.motor_current_high");
  offer(Watched::supply_voltage_low, motor.value<"power_safety.volt_input_low">(), "power_safety.volt_input_low");
  offer(Watched::supply_voltage_high, motor.value<"power_safety.volt_input_high">(), "power_safety.volt_input_high");
  offer(Watched::coil_temperature, motor.value<"power_safety.temperature_coil_high">(),
        "power_safety.temperature_coil_high");
  offer(Watched::coil_temperature, motor.value<"coil_temperature_estimator.otw">(), "coil_temperature_estimator.otw");
}

/// What no file says and no device.
void offer_own(Table& table, const profiles::Bench& place) {
  table.offer(Watched::speed_error, 100 * SpeedWatch::kShare, "kphi");
  table.offer(Watched::load_cell_age, to_seconds(spin_patience(place)), "kphi, while the motor turns");
  table.offer(Watched::motor_age, to_seconds(spin_patience(place)), "kphi, while the motor turns");
  if (place.supply) table.offer(Watched::supply_age, kSupplyPatience, "kphi");
  table.offer(Watched::pause, kLongestPause, "kphi, while the motor turns");
}

}  // namespace

DeviceLimits device_limits(Bench& bench) {
  return {bench.load_cell().configuration().range, bench.motor().parameters()};
}

DeviceLimits device_limits(const results::RunHeader& header) {
  return {header.load_cell.range, iq::AuditRecord::of(header.motor_parameters)};
}

std::vector<GuardLimit> combine_limits(const profiles::Campaign& campaign, const profiles::Bench& place,
                                       const DeviceLimits* devices) {
  Table table;
  offer_campaign(table, campaign.limits);
  offer_bench(table, place);
  if (devices != nullptr) offer_devices(table, *devices);
  offer_own(table, place);
  auto rows = table.rows();
  if (!place.supply) std::erase_if(rows, [](const auto& row) { return row.watched == Watched::output_current; });
  return rows;
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
