#include "daq/interlock.hpp"

#include <fmt/format.h>

#include <utility>

namespace kphi::daq {
namespace {

std::string words(const GuardLimit& limit, double value) {
  if (limit.watched <= Watched::torque_z) {
    const double range = limit.value / kRangeBorne;
    return fmt::format("load cell: {} carries {:.0f} % of its range of {:g} {}", limit.name, 100 * value / range, range,
                       limit.unit);
  }
  if (limit.watched == Watched::pause)
    return fmt::format("kphi was blocked for {:.2g} s while the motor was turning", value);
  const std::string shown = limit.unit == "RPM" ? fmt::format("{:.0f}", value) : fmt::format("{:.4g}", value);
  return fmt::format("{} {} {} is {} ({})", limit.name, shown, limit.unit, to_words(limit), limit.source);
}

}  // namespace

Trip passed(const GuardLimit& limit, double value, Instant sample) {
  Trip trip;
  trip.watched = limit.watched;
  trip.reason = words(limit, value);
  trip.value = value;
  trip.limit = limit;
  trip.sample = sample;
  return trip;
}

std::string next_move(const Trip& trip) {
  switch (trip.watched) {
    case Watched::force_x:
    case Watched::force_y:
    case Watched::force_z:
    case Watched::torque_x:
    case Watched::torque_y:
    case Watched::torque_z:
    case Watched::thrust:
    case Watched::shaft_torque:
      return "check propeller, occlusion and load cell for damage and a lost fastening";
    case Watched::speed:
    case Watched::speed_error:
      return "check for a blocked rotor, a loose propeller, a weak supply";
    case Watched::supply_current:
    case Watched::output_current:
    case Watched::motor_current:
      return "check for a blocked rotor and a short circuit";
    case Watched::supply_voltage_low:
    case Watched::supply_voltage_high:
      return "check the supply, its leads and its limits";
    case Watched::coil_temperature:
      return "let the motor cool; add limits.cooling to the campaign, or use shorter steps";
    case Watched::load_cell_age:
    case Watched::samples_missing:
      return "check the box's power and network cable: `kphi devices`";
    case Watched::motor_age:
      return "check the motor's cable and power: `kphi devices`";
    case Watched::supply_age:
      return "check the supply's cable: `kphi devices`";
    case Watched::pause:
      return "close other programs; do not stop kphi with Ctrl-Z";
    case Watched::sleep:
      return "disable sleep, keep the lid open, then look at the stand before you continue";
    case Watched::state:
      break;
  }
  return "look at the stand before you continue";
}

bool Latch::set(Trip trip) noexcept {
  State expected = State::open;
  if (!state_.compare_exchange_strong(expected, State::closing)) return false;
  trip_ = std::move(trip);
  state_.store(State::closed);
  return true;
}

const Trip* Latch::trip() const noexcept { return state_.load() == State::closed ? &trip_ : nullptr; }

void Latch::check() const {
  if (const Trip* trip = this->trip()) throw SafetyStop(*trip);
}

}  // namespace kphi::daq
