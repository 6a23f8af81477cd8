#include "daq/guard/guard_limits.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daq/guard/speed_error.hpp"

namespace kphi::daq {
namespace {

constexpr double kSupplyPatience = 2;    // s; the supply is read eight times per second
constexpr double kLongestPause = 0.4;    // s; the driver coasts the motor after 0.5 s
constexpr double kMeterOfSupply = 1.02;  // a supply that limits its current shows a little more than its limit

/// One limit per quantity, the tightest that was offered.
class Table {
 public:
  /// Ignores a value that is missing or not a positive, finite number.
  void offer(Watched watched, const std::optional<double>& value, const std::string& source) {
    if (!value || !std::isfinite(*value) || *value <= 0) return;
    const GuardedQuantity& row = row_of(watched);
    const bool lower = row.sense == Sense::lower;
    auto& have = limits_[static_cast<std::size_t>(watched)];
    if (!have || (lower ? *value > have->value : *value < have->value))
      have = GuardLimit{watched, row.name, *value, row.unit, source, lower};
  }
  [[nodiscard]] std::vector<GuardLimit> limits() const {
    std::vector<GuardLimit> limits;
    for (const auto& limit : limits_) {
      if (limit) limits.push_back(*limit);
    }
    return limits;
  }

 private:
  std::array<std::optional<GuardLimit>, kWatchedCount> limits_;
};

std::optional<double> scaled(const std::optional<double>& value, double factor) {
  return value ? std::optional(factor * *value) : std::nullopt;
}

void offer_campaign(Table& table, const profiles::Limits& limits) {
  for (const GuardedQuantity& row : kQuantities) {
    if (row.campaign_limit == nullptr) continue;
    table.offer(row.watched, row.campaign_limit(limits), std::string("campaign limits.") + row.campaign_key + row.note);
  }
}

void offer_bench(Table& table, const profiles::BenchConfig& config) {
  table.offer(Watched::speed, kOvershoot * to_rpm(config.iq.speed_max),
              "bench iq.speed_max_rpm, 5 % overshoot allowed");
  if (!config.supply) return;
  table.offer(Watched::supply_voltage_high, config.supply->over_voltage.value(), "bench supply.over_voltage_v");
  table.offer(Watched::output_current, kMeterOfSupply * config.supply->over_current.value(),
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

/// Limits that neither a file nor a device sets.
void offer_own(Table& table, const profiles::BenchConfig& config) {
  table.offer(Watched::speed_error, 100 * SpeedWatch::kShare, "kphi");
  table.offer(Watched::load_cell_age, to_seconds(spin_patience(config)), "kphi, while the motor turns");
  table.offer(Watched::motor_age, to_seconds(spin_patience(config)), "kphi, while the motor turns");
  if (config.supply) table.offer(Watched::supply_age, kSupplyPatience, "kphi");
  table.offer(Watched::pause, kLongestPause, "kphi, while the motor turns");
}

}  // namespace

DeviceLimits device_limits(Bench& bench) {
  return {bench.load_cell().configuration().range, bench.motor().parameters()};
}

DeviceLimits device_limits(const results::RunHeader& header) {
  return {header.load_cell.range, iq::AuditRecord::of(header.motor_parameters)};
}

std::vector<GuardLimit> combine_limits(const profiles::Campaign& campaign, const profiles::BenchConfig& config,
                                       const DeviceLimits* devices) {
  Table table;
  offer_campaign(table, campaign.limits);
  offer_bench(table, config);
  if (devices != nullptr) offer_devices(table, *devices);
  offer_own(table, config);
  auto limits = table.limits();
  if (!config.supply)
    std::erase_if(limits, [](const auto& limit) { return row_of(limit.watched).source == Source::supply; });
  return limits;
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
