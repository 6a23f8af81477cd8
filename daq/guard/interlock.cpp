#include "daq/guard/interlock.hpp"

#include <fmt/format.h>

#include <utility>

namespace kphi::daq {
namespace {

std::string words(const GuardLimit& limit, double value) {
  if (is_load_cell_axis(limit.watched)) {
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
  trip.source = limit.watched < Watched::samples_missing ? row_of(limit.watched).source : Source::load_cell;
  trip.reason = words(limit, value);
  trip.value = value;
  trip.limit = limit;
  trip.sample = sample;
  return trip;
}

std::string next_move(const Trip& trip) {
  if (trip.watched < Watched::samples_missing) return row_of(trip.watched).next_move;
  if (trip.watched == Watched::samples_missing) return kCheckBox;
  if (trip.watched == Watched::sleep)
    return "disable sleep, keep the lid open, then look at the stand before you continue";
  return kCheckStand;
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
