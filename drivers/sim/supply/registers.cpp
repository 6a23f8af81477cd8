#include "drivers/sim/supply/registers.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

namespace kphi::sim {
namespace {

constexpr std::uint16_t kInputVolts = 2405;  // of 10 mV
constexpr std::uint16_t kFirmware = 128;

std::uint16_t counted(double value, double counts_per_unit) {
  return static_cast<std::uint16_t>(std::clamp(std::round(value * counts_per_unit), 0.0, 65535.0));
}

enum class Access : std::uint8_t { read, write, harmful };

/// Registers with one meaning.
struct Row {
  unsigned first, last;
  SupplyQuantity shows;
  Access access = Access::read;
  unsigned of_sixteen = 16;  ///< only the first this many of each sixteen registers exist
  std::uint16_t value = 0;   ///< of a constant
};

// The first row that fits counts.
using enum SupplyQuantity;
constexpr Row kRiden[] = {
    {0, 0, model_id},
    {1, 1, serial_high},
    {2, 2, serial_low},
    {3, 3, constant, Access::read, 16, kFirmware},
    {8, 8, set_volts, Access::write},
    {9, 9, set_amps, Access::write},
    {10, 10, volts},
    {11, 11, amps},
    {14, 14, constant, Access::read, 16, kInputVolts},
    {16, 16, trip},
    {17, 17, limiting},
    {18, 18, output, Access::write},
    {19, 19, preset, Access::write},
    {82, 82, over_volts, Access::write},
    {83, 83, over_amps, Access::write},
    {20, 20, kept, Access::write},
    {48, 53, kept, Access::write},
    {55, 62, kept, Access::harmful},  // calibration
    {66, 72, kept, Access::write},
    {80, 119, kept, Access::write},     // presets
    {256, 256, kept, Access::harmful},  // boot loader
    {0, 119, kept},
};
constexpr Row kDps[] = {{0x00, 0x00, set_volts, Access::write},
                        {0x50, 0x50, set_volts, Access::write},
                        {0x01, 0x01, set_amps, Access::write},
                        {0x51, 0x51, set_amps, Access::write},
                        {0x02, 0x02, volts},
                        {0x03, 0x03, amps},
                        {0x04, 0x04, kept},
                        {0x05, 0x05, constant, Access::read, 16, kInputVolts},
                        {0x06, 0x06, kept, Access::write},
                        {0x07, 0x07, trip},
                        {0x08, 0x08, limiting},
                        {0x09, 0x09, output, Access::write},
                        {0x0A, 0x0A, kept, Access::write},
                        {0x0B, 0x0B, model_id},
                        {0x0C, 0x0C, constant, Access::read, 16, kFirmware},
                        {0x23, 0x23, kept, Access::write},
                        {0x52, 0x52, over_volts, Access::write},
                        {0x53, 0x53, over_amps, Access::write},
                        {0x50, 0xE7, kept, Access::write, 8}};
constexpr Row kHanmatek[] = {{0x01, 0x01, output, Access::write},
                             {0x02, 0x02, trip},
                             {0x03, 0x03, model_id},
                             {0x04, 0x04, constant, Access::read, 16, 0x4B50},
                             {0x05, 0x05, constant, Access::read, 16, 0x0233},
                             {0x10, 0x10, volts},
                             {0x11, 0x11, amps},
                             {0x12, 0x13, kept},
                             {0x20, 0x20, over_volts, Access::write},
                             {0x21, 0x21, over_amps, Access::write},
                             {0x22, 0x23, kept, Access::write},
                             {0x30, 0x30, set_volts, Access::write},
                             {0x31, 0x31, set_amps, Access::write},
                             {0x9999, 0x9999, kept, Access::write}};

/// nullptr: no such register.
const Row* find(SupplyModel::Family family, std::uint16_t at) {
  constexpr std::span<const Row> kFamilies[] = {kRiden, kDps, kHanmatek};
  for (const Row& row : kFamilies[static_cast<std::size_t>(family)]) {
    if (at >= row.first && at <= row.last && at % 16u < row.of_sixteen) return &row;
  }
  return nullptr;
}

}  // namespace

const std::vector<SupplyModel>& supply_models() {
  using F = SupplyModel::Family;
  static const std::vector<SupplyModel> kModels{
      {"RD6006", F::riden, 60062, 100, 1000, 0, 60, 125},  {"RD6006P", F::riden, 60065, 1000, 10000, 0, 60, 125},
      {"RD6012", F::riden, 60121, 100, 100, 0, 60, 125},   {"RD6012P", F::riden, 60125, 1000, 10000, 1000, 60, 125},
      {"RD6018", F::riden, 60181, 100, 100, 0, 60, 125},   {"RD6024", F::riden, 60241, 100, 100, 0, 60, 125},
      {"RD6030", F::riden, 60301, 100, 100, 0, 60, 125},   {"DPS3005", F::dps, 3005, 100, 1000, 0, 30, 32},
      {"DPS5005", F::dps, 5005, 100, 1000, 0, 50, 32},     {"DPH5005", F::dps, 5205, 100, 1000, 0, 50, 32},
      {"DPS5015", F::dps, 5015, 100, 100, 0, 50, 32},      {"DPS5020", F::dps, 5020, 100, 100, 0, 50, 32},
      {"DPS8005", F::dps, 8005, 100, 1000, 0, 80, 32},     {"HM305P", F::hanmatek, 305, 100, 1000, 0, 30, 32},
      {"HM310P", F::hanmatek, 3010, 100, 1000, 0, 30, 32},
  };
  return kModels;
}

SupplyRegisters::SupplyRegisters(const std::string& model, std::uint32_t serial, bool over_current_in_milliamps,
                                 SupplyCircuit& circuit)
    : model_(nullptr), serial_(serial), over_current_in_milliamps_(over_current_in_milliamps), circuit_(circuit) {
  for (const SupplyModel& known : supply_models())
    if (known.name == model) model_ = &known;
  if (model_ == nullptr) throw std::invalid_argument("the simulator has no supply model \"" + model + "\"");
  circuit_.controls().over_volts = model_->volts_max * 1.03;
}

std::optional<std::uint16_t> SupplyRegisters::read(std::uint16_t at) const {
  const Row* row = find(model_->family, at);
  if (row == nullptr) return std::nullopt;
  return row->shows == constant ? row->value : value_of(row->shows, at);
}

bool SupplyRegisters::write(std::uint16_t at, std::uint16_t value) {
  const Row* row = find(model_->family, at);
  if (row == nullptr || row->access == Access::read) return false;
  if (row->access == Access::harmful) ++harmful_writes_;
  memory_[at] = value;
  SupplyControls& controls = circuit_.controls();
  if (row->shows == set_volts) controls.volts = value / per_v();
  if (row->shows == set_amps) controls.amps = value / per_a();
  if (row->shows == over_volts) controls.over_volts = value / per_v();
  if (row->shows == over_amps) controls.over_amps = value / per_over_a();
  if (row->shows == output) circuit_.switch_output(value != 0);
  if (row->shows == preset) recall(value);
  return true;
}

std::uint16_t SupplyRegisters::value_of(SupplyQuantity shows, std::uint16_t at) const {
  const SupplyControls& controls = circuit_.controls();
  if (shows == kept) return remembered(at);
  if (shows == model_id) return model_->id;
  if (shows == serial_high) return static_cast<std::uint16_t>(serial_ >> 16);
  if (shows == serial_low) return static_cast<std::uint16_t>(serial_);
  if (shows == set_volts) return counted(controls.volts, per_v());
  if (shows == set_amps) return counted(controls.amps, per_a());
  if (shows == volts) return counted(circuit_.shown_volts(), per_v());
  if (shows == amps) return counted(circuit_.shown_amps(), per_a());
  if (shows == trip) return trip_code();
  if (shows == limiting) return circuit_.limiting();
  if (shows == output) return circuit_.output();
  const bool written = memory_.contains(at);
  if (shows == over_volts) return written ? remembered(at) : counted(controls.over_volts, per_v());
  if (shows == over_amps) return written ? remembered(at) : counted(controls.over_amps, per_over_a());
  return 0;  // the preset
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
  return over_current_in_milliamps_ ? 1000 : 100;
}

std::uint16_t SupplyRegisters::trip_code() const noexcept {
  const auto cause = static_cast<unsigned>(circuit_.tripped());
  const bool bits = model_->family == SupplyModel::Family::hanmatek;
  return static_cast<std::uint16_t>(bits && cause > 0 ? 1u << (cause - 1) : cause);
}

void SupplyRegisters::recall(std::uint16_t preset) {
  if (preset > 9) return;
  const auto first = static_cast<std::uint16_t>(80 + 4 * preset);
  SupplyControls& controls = circuit_.controls();
  controls.volts = remembered(first) / per_v();
  controls.amps = remembered(static_cast<std::uint16_t>(first + 1)) / per_a();
  // Registers 82 and 83 still show the thresholds of M0.
  controls.over_volts = remembered(static_cast<std::uint16_t>(first + 2)) / per_v();
  controls.over_amps = remembered(static_cast<std::uint16_t>(first + 3)) / per_a();
}

}  // namespace kphi::sim
