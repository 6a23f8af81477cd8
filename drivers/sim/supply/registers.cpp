#include "drivers/sim/supply/registers.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace kphi::sim {
namespace {

constexpr double kInputVolts = 24.05;
constexpr std::uint16_t kFirmware = 128;
constexpr int kCelsius = 31;

std::uint16_t counted(double value, double counts_per_unit) {
  return static_cast<std::uint16_t>(std::clamp(std::round(value * counts_per_unit), 0.0, 65535.0));
}

std::uint32_t counted32(double value, double counts_per_unit) {
  return static_cast<std::uint32_t>(std::clamp(std::round(value * counts_per_unit), 0.0, 4294967295.0));
}

std::uint16_t half(std::uint32_t value, bool low) {
  return static_cast<std::uint16_t>(low ? value & 0xFFFFu : value >> 16);
}

bool within(std::uint16_t at, unsigned first, unsigned last) { return at >= first && at <= last; }

}  // namespace

const std::vector<SupplyModel>& supply_models() {
  using F = SupplyModel::Family;
  static const std::vector<SupplyModel> kModels{
      {"RD6006", F::riden, 60062, 100, 1000, 0, 60, 125}, {"RD6006P", F::riden, 60065, 1000, 10000, 0, 60, 125},
      {"RD6012", F::riden, 60121, 100, 100, 0, 60, 125},  {"RD6012P", F::riden, 60125, 1000, 10000, 1000, 60, 125},
      {"RD6018", F::riden, 60181, 100, 100, 0, 60, 125},  {"RD6024", F::riden, 60241, 100, 100, 0, 60, 125},
      {"DPS3005", F::dps, 3005, 100, 1000, 0, 30, 32},    {"DPS5005", F::dps, 5005, 100, 1000, 0, 50, 32},
      {"DPH5005", F::dps, 5205, 100, 1000, 0, 50, 32},    {"DPS5015", F::dps, 5015, 100, 100, 0, 50, 32},
      {"DPS5020", F::dps, 5020, 100, 100, 0, 50, 32},     {"DPS8005", F::dps, 8005, 100, 1000, 0, 80, 32},
      {"HM305P", F::hanmatek, 305, 100, 1000, 0, 30, 32}, {"HM310P", F::hanmatek, 3010, 100, 1000, 0, 30, 32},
  };
  return kModels;
}

SupplyRegisters::SupplyRegisters(const std::string& model, std::uint32_t serial, const SupplyDisputes& disputes,
                                 SupplyCircuit& circuit)
    : model_(nullptr), serial_(serial), disputes_(disputes), circuit_(circuit) {
  for (const SupplyModel& known : supply_models()) {
    if (known.name == model) model_ = &known;
  }
  if (model_ == nullptr) throw std::invalid_argument("the simulator has no supply model \"" + model + "\"");
  circuit_.controls().over_volts = model_->volts_max * 1.03;
}

std::optional<std::uint16_t> SupplyRegisters::read(std::uint16_t at) const {
  switch (model_->family) {
    case SupplyModel::Family::riden:
      return read_riden(at);
    case SupplyModel::Family::dps:
      return read_dps(at);
    default:
      return read_hanmatek(at);
  }
}

bool SupplyRegisters::write(std::uint16_t at, std::uint16_t value) {
  switch (model_->family) {
    case SupplyModel::Family::riden:
      return write_riden(at, value);
    case SupplyModel::Family::dps:
      return write_dps(at, value);
    default:
      return write_hanmatek(at, value);
  }
}

std::uint16_t SupplyRegisters::remembered(std::uint16_t at) const {
  const auto found = memory_.find(at);
  return found == memory_.end() ? std::uint16_t{0} : found->second;
}

double SupplyRegisters::per_a() const noexcept {
  return model_->counts_per_a_wide > 0 && remembered(20) == 1 ? model_->counts_per_a_wide : model_->counts_per_a;
}

double SupplyRegisters::per_over_a() const noexcept {
  if (model_->family != SupplyModel::Family::hanmatek) return per_a();
  return disputes_.over_current_in_milliamps ? 1000 : 100;
}

std::uint16_t SupplyRegisters::trip_code() const noexcept {
  const auto cause = static_cast<unsigned>(circuit_.tripped());
  const bool bits = model_->family == SupplyModel::Family::hanmatek;
  return static_cast<std::uint16_t>(bits && cause > 0 ? 1u << (cause - 1) : cause);
}

std::optional<std::uint16_t> SupplyRegisters::read_riden(std::uint16_t at) const {
  using Twelve = SupplyDisputes::Twelve;
  const SupplyControls& controls = circuit_.controls();
  const double watts = circuit_.shown_volts() * circuit_.shown_amps();
  const std::uint32_t power = counted32(watts, disputes_.power_in_milliwatts ? 1000 : 100);
  const std::uint32_t charge = counted32(circuit_.coulombs() / 3.6, 1), energy = counted32(circuit_.joules() / 3.6, 1);
  switch (at) {
    case 0:
      return model_->id;
    case 1:
    case 2:
      return half(serial_, at == 2);
    case 3:
      return kFirmware;
    case 5:
      return kCelsius;
    case 7:
      return kCelsius * 9 / 5 + 32;
    case 8:
      return counted(controls.volts, per_v());
    case 9:
      return counted(controls.amps, per_a());
    case 10:
      return counted(circuit_.shown_volts(), per_v());
    case 11:
      return counted(circuit_.shown_amps(), per_a());
    case 12:
      if (disputes_.register_12 == Twelve::milliampere_hours) return half(charge, true);
      return disputes_.register_12 == Twelve::power_high_word ? half(power, false) : std::uint16_t{0};
    case 13:
      return half(power, true);
    case 14:
      return counted(kInputVolts, 100);
    case 16:
      return trip_code();
    case 17:
      return circuit_.limiting();
    case 18:
      return circuit_.output();
    case 19:
      return disputes_.preset_reads_zero ? std::uint16_t{0} : remembered(19);
    case 38:
    case 39:
      return half(charge, at == 39);
    case 40:
    case 41:
      return half(energy, at == 41);
    case 82:
      return memory_.contains(82) ? remembered(82) : counted(controls.over_volts, per_v());
    case 83:
      return memory_.contains(83) ? remembered(83) : counted(controls.over_amps, per_a());
    default:
      return within(at, 0, 119) || at == 256 ? std::optional(remembered(at)) : std::nullopt;
  }
}

bool SupplyRegisters::write_riden(std::uint16_t at, std::uint16_t value) {
  SupplyControls& controls = circuit_.controls();
  if (within(at, 55, 62) || at == 256) ++harmful_writes_;
  const bool writable = at == 8 || at == 9 || within(at, 18, 20) || within(at, 48, 53) || within(at, 55, 62) ||
                        within(at, 66, 72) || within(at, 80, 119) || at == 256;
  if (!writable) return false;
  memory_[at] = value;
  if (at == 8) controls.volts = value / per_v();
  if (at == 9) controls.amps = value / per_a();
  if (at == 18) circuit_.switch_output(value != 0);
  if (at == 19) recall(value);
  if (at == 82) controls.over_volts = value / per_v();
  if (at == 83) controls.over_amps = value / per_a();
  return true;
}

void SupplyRegisters::recall(std::uint16_t preset) {
  if (preset > 9) return;
  const auto first = static_cast<std::uint16_t>(80 + 4 * preset);
  SupplyControls& controls = circuit_.controls();
  controls.volts = remembered(first) / per_v();
  controls.amps = remembered(static_cast<std::uint16_t>(first + 1)) / per_a();
  // Registers 82 and 83 go on showing the thresholds of M0.
  controls.over_volts = remembered(static_cast<std::uint16_t>(first + 2)) / per_v();
  controls.over_amps = remembered(static_cast<std::uint16_t>(first + 3)) / per_a();
}

std::optional<std::uint16_t> SupplyRegisters::read_dps(std::uint16_t at) const {
  const SupplyControls& controls = circuit_.controls();
  switch (at) {
    case 0x00:
    case 0x50:
      return counted(controls.volts, per_v());
    case 0x01:
    case 0x51:
      return counted(controls.amps, per_a());
    case 0x02:
      return counted(circuit_.shown_volts(), per_v());
    case 0x03:
      return counted(circuit_.shown_amps(), per_a());
    case 0x04:
      return counted(circuit_.shown_volts() * circuit_.shown_amps(), 100);
    case 0x05:
      return counted(kInputVolts, 100);
    case 0x07:
      return trip_code();
    case 0x08:
      return circuit_.limiting();
    case 0x09:
      return circuit_.output();
    case 0x0B:
      return model_->id;
    case 0x0C:
      return kFirmware;
    case 0x52:
      return counted(controls.over_volts, per_v());
    case 0x53:
      return counted(controls.over_amps, per_a());
    default:
      return at <= 0x0C || at == 0x23 || (within(at, 0x50, 0xE7) && at % 16 < 8) ? std::optional(remembered(at))
                                                                                 : std::nullopt;
  }
}

bool SupplyRegisters::write_dps(std::uint16_t at, std::uint16_t value) {
  SupplyControls& controls = circuit_.controls();
  const bool writable =
      at <= 0x01 || at == 0x06 || at == 0x09 || at == 0x0A || at == 0x23 || (within(at, 0x50, 0xE7) && at % 16 < 8);
  if (!writable) return false;
  memory_[at] = value;
  if (at == 0x00 || at == 0x50) controls.volts = value / per_v();
  if (at == 0x01 || at == 0x51) controls.amps = value / per_a();
  if (at == 0x09) circuit_.switch_output(value != 0);
  if (at == 0x52) controls.over_volts = value / per_v();
  if (at == 0x53) controls.over_amps = value / per_a();
  return true;
}

std::optional<std::uint16_t> SupplyRegisters::read_hanmatek(std::uint16_t at) const {
  constexpr std::uint16_t kClass = 0x4B50, kDecimals = 0x0233;
  const SupplyControls& controls = circuit_.controls();
  const std::uint32_t power = counted32(circuit_.shown_volts() * circuit_.shown_amps(), 1000);
  switch (at) {
    case 0x01:
      return circuit_.output();
    case 0x02:
      return trip_code();
    case 0x03:
      return model_->id;
    case 0x04:
      return kClass;
    case 0x05:
      return kDecimals;
    case 0x10:
      return counted(circuit_.shown_volts(), per_v());
    case 0x11:
      return counted(circuit_.shown_amps(), per_a());
    case 0x12:
    case 0x13:
      return half(power, at == 0x13);
    case 0x20:
      return counted(controls.over_volts, per_v());
    case 0x21:
      return counted(controls.over_amps, per_over_a());
    case 0x22:
    case 0x23:
    case 0x9999:
      return remembered(at);
    case 0x30:
      return counted(controls.volts, per_v());
    case 0x31:
      return counted(controls.amps, per_a());
    default:
      return std::nullopt;
  }
}

bool SupplyRegisters::write_hanmatek(std::uint16_t at, std::uint16_t value) {
  SupplyControls& controls = circuit_.controls();
  if (at == 0x01) {
    circuit_.switch_output(value != 0);
  } else if (at == 0x20) {
    controls.over_volts = value / per_v();
  } else if (at == 0x21) {
    controls.over_amps = value / per_over_a();
  } else if (at == 0x30) {
    controls.volts = value / per_v();
  } else if (at == 0x31) {
    controls.amps = value / per_a();
  } else if (at == 0x22 || at == 0x23 || at == 0x9999) {
    memory_[at] = value;
  } else {
    return false;
  }
  return true;
}

}  // namespace kphi::sim
