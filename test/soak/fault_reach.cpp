#include "test/soak/fault_reach.hpp"

#include <algorithm>
#include <array>

#include "drivers/sim/input_files.hpp"

namespace kphi::soak {
namespace {

using namespace std::chrono_literals;

/// What comes later than a fault's end: what was held back, and how long the driver waits for it.
constexpr Duration kEcho = 1s;

bool goes_on(sim::FaultKind kind) {
  using K = sim::FaultKind;
  constexpr std::array kOn{K::zero_drift,   K::clock_skew, K::taken_over,      K::reboot,      K::rate,
                           K::units,        K::overrun,    K::ft_jump_back,    K::wrap,        K::motor_baud,
                           K::motor_unplug, K::motor_hot,  K::motor_brown_out, K::supply_trip, K::supply_panel};
  return std::find(kOn.begin(), kOn.end(), kind) != kOn.end();
}

bool silences(sim::FaultKind kind) {
  using K = sim::FaultKind;
  return kind == K::motor_deaf || kind == K::motor_command_flip || kind == K::motor_unplug ||
         kind == K::motor_ignore_sets || kind == K::motor_baud;
}

Device device_of(sim::FaultKind kind) {
  if (sim::within(kind, sim::FaultKind::motor_flip, sim::FaultKind::motor_locked)) return Device::motor;
  if (sim::on_supply(kind)) return Device::supply;
  return sim::on_air_sensor(kind) ? Device::air : Device::load_cell;
}

/// A latched monitor condition is no error.
bool is_harmless(const sim::Fault& fault) { return fault.kind == sim::FaultKind::status && fault.bits == 0x80010000u; }

bool goes_on(const sim::Fault& fault) {
  if (fault.kind == sim::FaultKind::status) return fault.latched || fault.lasts == Duration{0};
  return goes_on(fault.kind);
}

}  // namespace

Reaches::Reaches(const std::string& faults) {
  for (const sim::Fault& f : sim::parse_faults(faults, "faults").faults) {
    if (is_harmless(f)) continue;
    const Device device = device_of(f.kind);
    if (device == Device::load_cell) cell_.push_back(f);
    const Instant end = goes_on(f) ? kNever : f.at + (f.lasts > Duration{0} ? f.lasts + f.delay : f.lasts) + kEcho;
    all_.push_back({device, std::string(sim::name_of(f.kind)), f.at, end, silences(f.kind)});
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
