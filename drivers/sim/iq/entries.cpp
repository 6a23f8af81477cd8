#include "drivers/sim/iq/entries.hpp"

#include <bit>
#include <cmath>

namespace kphi::sim {
namespace {

using enum IqFormat;
using enum IqPresence;

constexpr std::uint8_t G = 1, S = 2, GS = 3, GSV = 7;

// Type, sub, format, access, value, firmware, count: all that the vendor's clients may ask. Values: published numbers
// of the 2306 where there are any, otherwise plausible; velocity_Kp, Ki and ff are tuned for 5" and 6" propellers. A
// read-only row that follows the physics holds 0.
constexpr auto kEntries = std::to_array<IqEntry>({
    // system_control
    {5, 0, none, S},
    {5, 2, u16, G, 0x0438},
    {5, 3, u16, G, 1},
    {5, 4, u32, G, 0x00230006},
    {5, 5, u32, G, 0x4d4b5011},
    {5, 6, u32, G, 0x20343353},
    {5, 7, u16, G, 64},
    {5, 8, u16, G, 2021},
    {5, 9, u8, G, 3},
    {5, 10, u8, G, 1},
    {5, 11, u8, G, 12},
    {5, 12, u8, G, 0, always, 2},
    {5, 14, u8, GSV, 0},
    {5, 15, f32, G},
    {5, 16, u32, G, 0x00100020},    // firmware: speed 0.0.32
    {5, 17, u32, GSV, 0x00010100},  // hardware: type 1, major 1
    {5, 18, u32, GSV, 0x00030000},  // electronics: type 3
    {5, 19, u8, G, 1},
    {5, 20, u8, G, 5},  // boot loader, application
    {5, 21, u32, G, 0x00000083},
    {5, 22, u32, G},
    {5, 23, u32, G, 72'000'000},
    {5, 24, u32, G},
    {5, 25, u32, G, 0x00010000},
    // serial_interface
    {16, 0, u32, G, 115200},
    // brushless_drive
    {50, 0, u8, G},
    {50, 1, f32, S, 0, always, 4},
    {50, 5, none, S, 0, always, 2},
    {50, 7, f32, G, 0, always, 7},
    {50, 14, u16, GSV, 7},
    {50, 15, u8, GSV, 0, always, 2},
    {50, 17, f32, GSV, 1.25},
    {50, 18, f32, GSV, 2.5e-5},
    {50, 19, u32, GSV, 48000},
    {50, 20, f32, GS, 0, always, 2},
    {50, 22, u8, GSV, 1},
    {50, 23, f32, G, 0, always, 2},
    {50, 25, f32, GSV, 0.5},
    {50, 26, f32, GSV, 0.1},
    {50, 27, f32, GSV, 10},
    {50, 29, f32, GSV, 26},
    {50, 32, f32, GSV, 2200},
    {50, 33, f32, GSV, 0.045},  // motor and controller
    {50, 34, f32, GSV, 30},
    {50, 35, f32, GSV, 27},
    {50, 36, f32, G, 0, always, 2},
    {50, 38, f32, GSV, 3400},
    {50, 39, f32, GSV, 3500},
    {50, 40, f32, GSV, 1.5e-5},
    {50, 41, i32, G, 65536},
    {50, 42, f32, GSV, 28},
    {50, 43, f32, GSV, 30},
    {50, 44, f32, G, 0, always, 2},
    {50, 46, f32, GSV, 500},
    {50, 47, u8, GSV, 0},
    {50, 61, u32, GSV, 100},
    {50, 62, u32, GSV, 1000},
    // propeller_motor_control
    {52, 0, i8, G, 1},
    {52, 1, none, S, 0, always, 2},
    {52, 3, f32, GS, 0, always, 3},
    {52, 7, f32, GSV, 0.02},
    {52, 8, f32, GSV, 0.9},
    {52, 9, f32, GSV, 0},
    {52, 10, f32, GSV, 0.006},
    {52, 11, f32, GSV, 0.0043},
    {52, 12, f32, GSV, 2.0e-7},
    {52, 15, f32, GSV, 0.5},
    {52, 16, u32, GSV, 100},
    {52, 17, u8, GSV, 0, current, 2},
    {52, 19, u8, GSV, 1, current},
    // esc_propeller_input_parser
    {60, 0, u8, GSV, 0},
    {60, 1, f32, GS, 0},
    {60, 3, u8, GSV, 0},
    {60, 4, f32, GSV, 12.6},
    {60, 5, f32, GSV, 2800},
    {60, 6, f32, GSV, 10},
    {60, 7, f32, GSV, 1},
    {60, 8, u8, GSV, 0},
    {60, 9, f32, GSV, 0},
    {60, 10, f32, GSV, 0.04},
    {60, 11, u8, GSV, 0},
    // power_monitor
    {69, 0, f32, G, 0, always, 4},
    {69, 5, u32, G, 40000},
    {69, 6, u32, GSV, 100},
    {69, 7, u16, G, 0, always, 2},
    {69, 9, f32, GSV, 0.009},
    {69, 10, f32, GSV, 0.03},
    {69, 11, f32, GSV, 2048},
    {69, 13, f32, GSV},
    {69, 14, u32, GSV, 10},
    // temperature_monitor_uc
    {73, 0, f32, G},
    {73, 1, u32, G, 1000},
    {73, 2, u32, GSV, 1},
    {73, 3, f32, GSV, 100},
    {73, 4, f32, GSV, 110},
    {73, 5, f32, G, 1},
    // hobby_input: disabled, as recommended on a stand
    {76, 0, u8, GSV, 254},
    {76, 1, u8, GS},
    {76, 2, u8, G},
    {76, 3, u32, GSV, 2000},
    {76, 4, u32, GSV, 1000},
    {76, 5, none, S},
    {76, 6, u16, GSV, 0},
    {76, 7, u8, GSV, 0, always, 2},
    // temperature_estimator
    {77, 0, f32, G, 0, legacy},
    {77, 1, f32, GSV, 140, legacy},
    {77, 2, f32, GSV, 150, legacy},
    {77, 3, f32, GSV, 3.3, legacy},
    {77, 4, f32, GSV, 6, legacy},
    {77, 5, i32, G, 65536, legacy},
    // coil_temperature_estimator
    {83, 0, f32, G, 0, current, 2},
    {83, 2, f32, GSV, 25, current},
    {83, 3, f32, GSV, 0.05, current},
    {83, 4, f32, GSV, 0.25, current},
    {83, 5, f32, G, 0, current},
    {83, 6, f32, GSV, 6, current},
    {83, 7, f32, GSV, 0.006, current},
    {83, 8, f32, GSV, 140, current},
    {83, 9, f32, GSV, 150, current},
    {83, 10, f32, G, 1, current},
    {83, 11, f32, G, 0, current, 3},
    // power_safety
    {84, 0, u8, G},
    {84, 1, u8, GS},
    {84, 2, u8, GSV, 1},
    {84, 3, f32, GSV, 5.0},
    {84, 4, f32, GSV, 30},
    {84, 5, f32, GSV, 1.15},
    {84, 6, f32, GSV, 1.25},
    {84, 7, f32, GSV, -40},
    {84, 8, f32, GSV, 40},
    {84, 9, f32, GSV, -60},
    {84, 10, f32, GSV, 60},
    {84, 11, f32, GSV, -40},
    {84, 12, f32, GSV, 115},
    {84, 13, f32, GSV, -40},
    {84, 14, f32, GSV, 160},
    // arming_handler
    {86, 1, u8, GSV, 0},
    {86, 2, u8, GSV, 1},
    {86, 3, f32, GSV, 0.075},
    {86, 4, f32, GSV, 0},
    {86, 5, u8, GSV, 0},
    {86, 6, f32, GSV, 0, always, 2},
    {86, 8, u32, GSV, 10},
    {86, 9, u8, GSV, 0, always, 3},
    {86, 12, u8, G, 0},
    {86, 13, u32, GSV, 10},
    {86, 14, u8, GSV, 0},
    // stopping_handler
    {87, 0, f32, GSV, 5},
    {87, 1, f32, GSV, 1},
    // iquart_flight_controller_interface
    {88, 2, u8, GSV, 255, always, 3},
});

}  // namespace

std::uint32_t iq_bits(IqFormat format, double value) noexcept {
  if (format == f32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

std::vector<IqEntry> iq_entries() {
  std::vector<IqEntry> all;
  for (IqEntry entry : kEntries) {
    for (int left = entry.count; left > 0; --left, ++entry.sub) all.push_back(entry);
  }
  return all;
}

bool iq_present(const IqEntry& entry, const IqQuirks& quirks) noexcept {
  if (quirks.no_power_safety && entry.type == 84) return false;
  if (quirks.no_volts_limit && entry.type == 50 && entry.sub == 35) return false;
  return entry.presence == always || (entry.presence == legacy) == quirks.legacy;
}

IqMemory::IqMemory(const IqQuirks& quirks) {
  for (const IqEntry& entry : iq_entries()) {
    const std::uint32_t bits = iq_bits(entry.format, entry.value);
    if (iq_present(entry, quirks)) cells_.insert({iq_key(entry.type, entry.sub), {entry, bits, bits}});
  }
  if (quirks.legacy) provide(5, 16, 0x0010000a);  // speed 0.0.10
}

double IqMemory::Cell::value() const noexcept {
  if (entry.format == f32) return static_cast<double>(std::bit_cast<float>(bits));
  if (entry.format == i8) return static_cast<std::int8_t>(bits);
  if (entry.format == i32) return static_cast<std::int32_t>(bits);
  return bits;
}

void IqMemory::Cell::store(double value) noexcept { bits = iq_bits(entry.format, value); }

IqMemory::Cell* IqMemory::find(std::uint8_t type, std::uint8_t sub) noexcept {
  const auto found = cells_.find(iq_key(type, sub));
  return found == cells_.end() ? nullptr : &found->second;
}

const IqMemory::Cell* IqMemory::find(std::uint8_t type, std::uint8_t sub) const noexcept {
  return const_cast<IqMemory*>(this)->find(type, sub);
}

double IqMemory::value(std::uint8_t type, std::uint8_t sub) const noexcept {
  const Cell* cell = find(type, sub);
  return cell == nullptr ? 0 : cell->value();
}

double IqMemory::finite(std::uint8_t type, std::uint8_t sub) const noexcept {
  const double stored = value(type, sub);
  return std::isfinite(stored) ? stored : 0;
}

void IqMemory::store(std::uint8_t type, std::uint8_t sub, double value) noexcept {
  if (Cell* cell = find(type, sub)) cell->store(value);
}

void IqMemory::provide(std::uint8_t type, std::uint8_t sub, double value) noexcept {
  if (Cell* cell = find(type, sub)) {
    cell->store(value);
    cell->save();
  }
}

void IqMemory::reboot() noexcept {
  for (auto& [key, cell] : cells_) cell.bits = cell.saved;
}

}  // namespace kphi::sim
