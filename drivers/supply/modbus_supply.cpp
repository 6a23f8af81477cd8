#include "drivers/supply/modbus_supply.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <stdexcept>
#include <utility>

#include "base/error.hpp"
#include "drivers/serial/port.hpp"

namespace kphi::supply {
namespace {

constexpr int kAttempts = 3;
constexpr double kMargin = 1.1;              // measured values may exceed the largest setting by this
constexpr std::uint16_t kDecimals = 0x0233;  // Hanmatek: voltage 2, current 3, power 3

}  // namespace

ModbusSupply::ModbusSupply(const Address& address, const Clock& clock, const Timing& timing)
    : address_(address), clock_(clock), link_(address, timing) {
  identity_.device = "supply on " + address.where();
  identify();
  describe();
}

void ModbusSupply::identify() {
  const Model* const wanted = address_.model.empty() ? nullptr : find_model(address_.model);
  std::string answers;
  for (const RegisterMap* map : families()) {
    if (wanted != nullptr && wanted->map != map) continue;
    model_ = ask_model(*map, answers);
    if (model_ != nullptr) break;
  }
  if (model_ == nullptr) {
    throw DeviceError(identity_.device, "identify", "unknown model: " + answers,
                      fmt::format("known are {}", fmt::join(model_names(), ", ")));
  }
  if (wanted != nullptr && wanted != model_) {
    throw DeviceError(identity_.device, "identify", fmt::format("found a {}, not a {}", model_->name, wanted->name),
                      "correct model= in its address, or the port");
  }
  if (const int at = model_->map->decimals; at != kAbsent && registers_[static_cast<std::size_t>(at)] != kDecimals) {
    throw DeviceError(identity_.device, "identify",
                      fmt::format("unknown format of its values {:#06x}", registers_[static_cast<std::size_t>(at)]),
                      fmt::format("only {:#06x} is known", kDecimals));
  }
  known_ = registers_;
}

/// nullptr: not of this family. Appends its answer to `answers`.
const Model* ModbusSupply::ask_model(const RegisterMap& map, std::string& answers) {
  const char* const join = answers.empty() ? "" : ", ";
  bool refused = false, refused_once = false;
  persist("identify", [&] {
    Outcome outcome = link_.read(map.identity, registers_);
    refused = outcome.failure == Failure::refused && std::exchange(refused_once, true);
    return refused ? Outcome{} : outcome;
  });
  if (refused) {
    answers += fmt::format("{}{} refused", join, map.family);
    return nullptr;
  }
  answers += fmt::format("{}{} register {} is {}", join, map.family, map.model, registers_[map.model]);
  return find_model(map, registers_[map.model]);
}

void ModbusSupply::describe() {
  const RegisterMap& map = *model_->map;
  identity_.model = model_->name;
  identity_.device = fmt::format("supply {} on {}", model_->name, address_.where());
  identity_.off = off_word(address_, map, identity_.device);
  if (map.serial != kAbsent) {
    const auto at = static_cast<std::size_t>(map.serial);
    identity_.serial = fmt::format("{:08}", static_cast<std::uint32_t>(registers_[at]) << 16 | registers_[at + 1]);
  }
  if (map.firmware != kAbsent) {
    const unsigned version = registers_[static_cast<std::size_t>(map.firmware)];
    identity_.firmware = fmt::format("{}.{:02}", version / 100, version % 100);
  }
  (void)read();  // after other requests: it has locked its keypad, if it does
  if (map.keypad != kAbsent) {
    const bool locked = registers_[static_cast<std::size_t>(map.keypad)] != 0;
    identity_.keypad = locked ? SupplyKeypad::locked : SupplyKeypad::said_free;
  }
  identity_.voltage_max_v = model_->max_v;
  identity_.current_max_a = range().max_a;
}

SupplyReading ModbusSupply::read(const std::function<void()>& between) {
  SupplyReading reading;
  persist("read", [&] { return look(reading, between); });
  return reading;
}

Outcome ModbusSupply::look(SupplyReading& reading, const std::function<void()>& between) {
  const Instant before = clock_.now();
  for (const Block& block : model_->map->look) {
    if (block.count == 0) continue;
    if (&block != model_->map->look.data()) between();
    if (Outcome outcome = link_.read(block, registers_); !outcome.ok()) return outcome;
  }
  const Instant after = clock_.now();
  reading.time_ns = (before + (after - before) / 2).count();
  reading.uncertainty_ns = ((after - before + Duration(1)) / 2).count();
  const std::string doubt = implausible(reading);
  return doubt.empty() ? Outcome{} : Outcome{Failure::damaged, doubt};
}

const CurrentRange& ModbusSupply::range() const noexcept {
  const int at = model_->map->current_range;
  const bool second = at != kAbsent && model_->ranges[1].max_a > 0 && registers_[static_cast<std::size_t>(at)] == 1;
  return model_->ranges[second ? 1 : 0];
}

/// Fills the reading from the registers. Returns what is impossible; empty: plausible.
std::string ModbusSupply::implausible(SupplyReading& reading) const {
  const RegisterMap& map = *model_->map;
  const auto at = [&](int address) { return registers_[static_cast<std::size_t>(address)]; };
  const CurrentRange& amps = range();
  reading.set_voltage_v = at(map.set_voltage) / model_->counts_per_v;
  reading.current_limit_a = at(map.current_limit) / amps.counts_per_a;
  reading.voltage_v = at(map.voltage) / model_->counts_per_v;
  reading.current_a = at(map.current) / amps.counts_per_a;
  reading.protection = protection_of(map, at(map.protection));
  reading.output = at(map.output) != 0;
  if (map.regulation != kAbsent) {
    reading.regulation =
        at(map.regulation) != 0 ? SupplyRegulation::constant_current : SupplyRegulation::constant_voltage;
  } else {
    // There is no register for it: constant current if at the limit with a reduced voltage.
    const bool limited = reading.output && at(map.current) + 1 >= at(map.current_limit);
    const bool gave_way = at(map.voltage) + 5 < at(map.set_voltage);
    reading.regulation = limited && gave_way ? SupplyRegulation::constant_current : SupplyRegulation::constant_voltage;
  }
  const auto beyond = [](const char* what, double value, double max) {
    return value > kMargin * max ? fmt::format("{} of {}", what, value) : std::string();
  };
  for (const std::string& doubt :
       {beyond("a set voltage", reading.set_voltage_v, model_->max_v),
        beyond("a current limit", reading.current_limit_a, amps.max_a),
        beyond("a voltage", reading.voltage_v, model_->max_v), beyond("a current", reading.current_a, amps.max_a),
        beyond("an output state", at(map.output), 1),
        beyond("a regulation", map.regulation == kAbsent ? 0 : at(map.regulation), 1),
        beyond("a current range", model_->ranges[1].max_a > 0 ? at(map.current_range) : 0, 1)}) {
    if (!doubt.empty()) return "implausible reply: " + doubt;
  }
  return {};
}

Limits ModbusSupply::apply(const Limits& limits) {
  (void)read();  // the current range may have been changed by hand
  const RegisterMap& map = *model_->map;
  const CurrentRange& amps = range();
  struct Setting {
    const char* name;
    const char* unit;
    Writable at;
    double value, counts_per_unit, max;
    std::uint16_t counts = 0;
  };
  const double per_v = model_->counts_per_v, max_v = model_->max_v;
  const double per_over_a =
      model_->over_current_counts_per_a > 0 ? model_->over_current_counts_per_a : amps.counts_per_a;
  Setting over_voltage{"over-voltage threshold", "V", map.over_voltage, limits.over_voltage.value(), per_v, max_v};
  Setting over_current{"over-current threshold",    "A",        map.over_current,
                       limits.over_current.value(), per_over_a, amps.max_a};
  Setting current{"current limit", "A", map.current_limit, limits.current.value(), amps.counts_per_a, amps.max_a};
  Setting voltage{"voltage", "V", map.set_voltage, limits.voltage.value(), per_v, max_v};
  const auto settings = {&over_voltage, &over_current, &current, &voltage};
  for (Setting* s : settings) {
    if (!fits(s->value, s->counts_per_unit, s->max))
      throw std::invalid_argument(fmt::format("{}: {} of {} {unit} is outside 0 to {} {unit}", identity_.device,
                                              s->name, s->value, s->max, fmt::arg("unit", s->unit)));
    s->counts = to_counts(s->value, s->counts_per_unit);
  }
  for (const Setting* s : settings)
    persist(fmt::format("set {}", s->name), [&] { return link_.write(s->at, s->counts, map.write_multiple); });
  persist("read thresholds", [&] { return link_.read(map.thresholds, registers_); });
  (void)read();
  for (const Setting* s : settings) {
    if (registers_[s->at] == s->counts) continue;
    throw DeviceError(
        identity_.device, fmt::format("set {}", s->name),
        fmt::format("set to {}, reads back {}", s->counts / s->counts_per_unit, registers_[s->at] / s->counts_per_unit),
        "unlock its panel, recall preset M0, and do not touch its front panel");
  }
  limits_applied_ = true;
  return {Volts(voltage.counts / per_v), Amperes(current.counts / amps.counts_per_a),
          Volts(over_voltage.counts / per_v), Amperes(over_current.counts / per_over_a)};
}

void ModbusSupply::switch_on() {
  if (!limits_applied_) {
    throw DeviceError(identity_.device, "switch on", "its limits are not set", "apply limits first");
  }
  persist("switch on", [&] { return link_.write(model_->map->output, 1, false); });
  const SupplyReading reading = read();
  if (reading.output && reading.protection == SupplyProtection::none) return;
  throw DeviceError(identity_.device, "switch on",
                    reading.protection == SupplyProtection::none
                        ? std::string("acknowledged, but the output stays off")
                        : fmt::format("switched off by itself: {} protection", name_of(reading.protection)),
                    "check the load, the thresholds and the panel");
}

void ModbusSupply::switch_off() {
  const Writable output = model_->map->output;
  if (!link_.write(output, 0, false).ok()) {
    unsettled_ = true;
    persist("switch off", [&] { return link_.write(output, 0, false); });
  }
  if (!read().output) return;
  persist("switch off", [&] { return link_.write(output, 0, false); });
  if (!read().output) return;
  throw DeviceError(identity_.device, "switch off", "acknowledged, but the output is still ON",
                    "switch it off by hand");
}

/// The advice fits the first failure: over TCP a late answer to the first request makes the next one look damaged.
void ModbusSupply::persist(const std::string& operation, const std::function<Outcome()>& attempt) {
  Outcome first, newest;
  int refusals = 0;  // stock firmware refuses a request now and then
  for (int i = 0; i < kAttempts && refusals < 2; ++i) {
    newest = unsettled_ ? settle() : Outcome{};
    if (newest.ok()) newest = attempt();
    if (newest.ok()) return;
    refusals += newest.failure == Failure::refused;
    if (!unsettled_) unsettled_ = newest.failure != Failure::busy && newest.failure != Failure::refused;
    if (first.ok()) first = newest;
  }
  const std::string then = newest.words == first.words ? "" : ", then " + newest.words;
  throw DeviceError(identity_.device, operation, first.words + then, remedy(first.failure));
}

/// After success no answer to an earlier request can arrive.
Outcome ModbusSupply::settle() {
  if (!link_.is_open()) {
    if (Outcome opened = link_.open(); !opened.ok()) return opened;
  }
  link_.fall_silent();
  if (model_ != nullptr) {
    const RegisterMap& map = *model_->map;
    if (Outcome asked = link_.read(map.identity, registers_); !asked.ok()) return asked;
    const auto same = [&](int at) {
      return at == kAbsent || registers_[static_cast<std::size_t>(at)] == known_[static_cast<std::size_t>(at)];
    };
    if (!same(map.model) || !same(map.serial) || (map.serial != kAbsent && !same(map.serial + 1)))
      return {Failure::damaged, "another device answers"};
  }
  unsettled_ = false;
  return {};
}

std::string ModbusSupply::remedy(Failure failure) const {
  const bool rtu = address_.wire == Address::Wire::rtu;
  if (failure == Failure::damaged) return "check cable and ground, and that no other program uses this line";
  if (failure == Failure::busy || failure == Failure::refused) return "check its model, firmware and panel lock";
  if (failure == Failure::timeout)
    return rtu ? fmt::format(
                     "check its power, that its interface is enabled, its baud rate ({} here; Riden 115200, DPS "
                     "and HM 9600) and its address ({} here)",
                     address_.baud, address_.slave)
               : "check its power, and that it supports Modbus TCP";
  if (!rtu) return "check host, port and network";
  const char* const device = address_.device.c_str();
  if (::access(device, F_OK) == 0 && ::access(device, R_OK | W_OK) != 0)
    return "permission denied; install drivers/udev/60-kphi.rules, or join the group dialout";
  const auto names = serial::stable_names();
  if (names.empty()) return "no serial adapter found; plug it in and try again";
  return fmt::format("plug it in, close other programs; available: {}", fmt::join(names, ", "));
}

}  // namespace kphi::supply
