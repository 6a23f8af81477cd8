#include "test/soak/fault_reach.hpp"

#include <algorithm>

#include "drivers/sim/input_files.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

/// What comes later than a fault's end: what was held back, and how long the driver waits for it.
constexpr Duration kEcho = 1s;

bool goes_on(sim::FaultKind kind) {
  using K = sim::FaultKind;
  return kind == K::zero_drift || kind == K::clock_skew || kind == K::taken_over || kind == K::reboot ||
         kind == K::rate || kind == K::units || kind == K::ft_jump_back || kind == K::overrun || kind == K::wrap;
}

bool goes_on(sim::MotorFaultKind kind) {
  using K = sim::MotorFaultKind;
  return kind == K::brown_out || kind == K::baud || kind == K::unplug || kind == K::hot;
}

bool silences(sim::MotorFaultKind kind) {
  using K = sim::MotorFaultKind;
  return kind == K::deaf || kind == K::command_flip || kind == K::unplug || kind == K::ignore_sets || kind == K::baud;
}

/// A latched monitor condition is no error.
bool is_harmless(const sim::Fault& fault) { return fault.kind == sim::FaultKind::status && fault.bits == 0x80010000u; }

bool goes_on(const sim::Fault& fault) {
  if (fault.kind == sim::FaultKind::status) return fault.latched || fault.lasts == Duration{0};
  return goes_on(fault.kind);
}

}  // namespace

Reaches::Reaches(const std::string& faults) {
  const sim::FaultFile file = sim::parse_faults(faults, "faults");
  cell_ = file.load_cell;
  std::erase_if(cell_, is_harmless);
  const auto end_of = [](const auto& fault, bool for_ever) {
    if (for_ever) return kNever;
    return fault.lasts > Duration{0} ? fault.at + fault.lasts + fault.delay + kEcho : fault.at + kEcho;
  };
  for (const auto& f : cell_) {
    all_.push_back({Device::load_cell, std::string(sim::name_of(f.kind)), f.at, end_of(f, goes_on(f))});
  }
  for (const auto& f : file.motor) {
    all_.push_back(
        {Device::motor, std::string(sim::name_of(f.kind)), f.at, end_of(f, goes_on(f.kind)), silences(f.kind)});
  }
  for (const auto& f : file.air)
    all_.push_back({Device::air, std::string(sim::ambient_faults().name_of(f.kind)), f.at, end_of(f, false)});
  for (const auto& f : file.supply) {
    const bool instant = f.kind == sim::SupplyFaultKind::trip || f.kind == sim::SupplyFaultKind::panel;
    all_.push_back({Device::supply, std::string(sim::supply_faults().name_of(f.kind)), f.at, end_of(f, instant)});
  }
}

bool Reaches::any(Instant from, Instant to) const noexcept {
  return std::any_of(all_.begin(), all_.end(), [&](const Reach& reach) { return reach.meets(from, to); });
}

bool Reaches::any(Device device, Instant from, Instant to) const noexcept {
  return std::any_of(all_.begin(), all_.end(),
                     [&](const Reach& reach) { return reach.device == device && reach.meets(from, to); });
}

bool Reaches::line_silenced(Instant from, Instant to) const noexcept {
  return std::any_of(all_.begin(), all_.end(),
                     [&](const Reach& reach) { return reach.silences_line && reach.meets(from, to); });
}

}  // namespace kphi::soak
