#include "daq/live/limit_bars.hpp"

#include <algorithm>
#include <cmath>

#include "daq/live/tick.hpp"
#include "daq/speed_error.hpp"

namespace kphi::daq::live {
namespace {

struct Look {
  const Position& position;
  const Observation& seen;
  const Moment& moment;
  const Clock& clock;

  [[nodiscard]] double of_cell(double value) const { return seen.load_cell_is_fresh ? value : kUnknown; }
  [[nodiscard]] double of_motor(double value) const { return seen.motor_is_fresh ? value : kUnknown; }
  [[nodiscard]] double of_supply(double value) const { return seen.supply.time_ns != 0 ? value : kUnknown; }
  [[nodiscard]] double wall_seconds(Duration bench) const { return to_seconds(clock.shrunk(bench)); }
  [[nodiscard]] bool is_told_to_turn() const { return position.commanded.value() > 0; }
};

/// As the guard judges it: beside what is always borne, and once the rotor has had its time.
double speed_error_percent(const Look& at) {
  if (!at.moment.settled || !at.is_told_to_turn()) return kUnknown;
  const double commanded = at.position.commanded.value();
  const double off = std::abs(at.seen.speed.value() - commanded) - SpeedWatch::kFloor;
  return at.of_motor(100 * std::max(0.0, off) / commanded);
}

double highest_voltage(const Look& at) {
  return std::fmax(at.of_motor(at.seen.module_voltage.value()), at.of_supply(at.seen.supply.voltage_v));
}

double supply_age_s(const Look& at) {
  return at.of_supply(at.wall_seconds(at.clock.now() - Instant(at.seen.supply.time_ns)));
}

template <std::size_t kAxis>
double load(const Look& at) {
  return at.of_cell(at.seen.loads[kAxis]);
}

struct Quantity {
  const char* key;
  const char* name;
  double (*value)(const Look&);
};

/// By Watched.
constexpr std::array<Quantity, kWatchedCount> kQuantities{{
    {"fx_n", "Fx", load<0>},
    {"fy_n", "Fy", load<1>},
    {"fz_n", "Fz", load<2>},
    {"tx_nm", "Tx", load<3>},
    {"ty_nm", "Ty", load<4>},
    {"tz_nm", "Tz", load<5>},
    {"thrust_n", "Thrust", [](const Look& at) { return at.of_cell(std::abs(at.seen.thrust.value())); }},
    {"torque_nm", "Shaft torque", [](const Look& at) { return at.of_cell(std::abs(at.seen.torque.value())); }},
    {"speed_rpm", "Speed", [](const Look& at) { return at.of_motor(to_rpm(at.seen.speed)); }},
    {"speed_error_percent", "Speed error", speed_error_percent},
    {"module_a", "Module current", [](const Look& at) { return at.of_motor(at.seen.supply_current.value()); }},
    {"supply_a", "Supply current", [](const Look& at) { return at.of_supply(at.seen.supply.current_a); }},
    {"motor_a", "Motor current", [](const Look& at) { return at.of_motor(std::abs(at.seen.motor_current.value())); }},
    {"voltage_low_v", "Voltage", [](const Look& at) { return at.of_motor(at.seen.module_voltage.value()); }},
    {"voltage_high_v", "Voltage", highest_voltage},
    {"coil_degc", "Coil", [](const Look& at) { return at.of_motor(at.seen.coil_temperature.value()); }},
    {"load_cell_age_s", "Cell silent", [](const Look& at) { return at.wall_seconds(at.seen.load_cell_age); }},
    {"motor_age_s", "Motor silent", [](const Look& at) { return at.wall_seconds(at.seen.motor_age); }},
    {"supply_age_s", "Supply silent", supply_age_s},
    {"pause_s", "Program silent",
     [](const Look& at) { return at.is_told_to_turn() ? at.wall_seconds(at.moment.pause) : kUnknown; }},
}};

}  // namespace

std::vector<LimitBar> limit_bars(const std::vector<GuardLimit>& limits) {
  std::vector<LimitBar> bars;
  for (const GuardLimit& limit : limits) {
    const Quantity& quantity = kQuantities[static_cast<std::size_t>(limit.watched)];
    bars.push_back({limit.watched, quantity.key, quantity.name, limit.unit, limit.value, limit.lower, limit.source});
  }
  return bars;
}

const char* key_of(Watched watched) { return kQuantities[static_cast<std::size_t>(watched)].key; }

double share_of(const LimitBar& bar, double value) { return bar.lower ? bar.limit / value : value / bar.limit; }

LimitValues limit_values(const Position& position, const Observation& seen, const Moment& moment, const Clock& clock) {
  LimitValues values;
  const Look look{position, seen, moment, clock};
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = kQuantities[i].value(look);
  return values;
}

}  // namespace kphi::daq::live
