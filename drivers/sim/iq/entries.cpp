#include "drivers/sim/iq/entries.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

namespace kphi::sim {
namespace {

using enum IqFormat;
using enum IqPresence;

constexpr std::uint8_t G = 1, S = 2, GS = 3, GSV = 7;

// type, sub, format, access, value, firmware. Sorted by type and sub. Values: published numbers of the 2306 where there
// are any, otherwise plausible; velocity_Kp, Ki and ff are tuned for 5" and 6" propellers. A
// read-only row that follows the physics holds 0.
constexpr std::array kEntries{
    // system_control
    IqEntry{5, 0, none, S},
    IqEntry{5, 1, none, S},
    IqEntry{5, 2, u16, G, 0x0438},
    IqEntry{5, 3, u16, G, 1},
    IqEntry{5, 4, u32, G, 0x00230006},
    IqEntry{5, 5, u32, G, 0x4d4b5011},
    IqEntry{5, 6, u32, G, 0x20343353},
    IqEntry{5, 7, u16, G, 64},
    IqEntry{5, 8, u16, G, 2021},
    IqEntry{5, 9, u8, G, 3},
    IqEntry{5, 10, u8, G, 1},
    IqEntry{5, 11, u8, G, 12},
    IqEntry{5, 12, u8, G},
    IqEntry{5, 13, u8, G},
    IqEntry{5, 14, u8, GSV, 0},
    IqEntry{5, 15, f32, GS},
    IqEntry{5, 16, u32, G, 0x00100020},    // firmware: speed 0.0.32
    IqEntry{5, 17, u32, GSV, 0x00010100},  // hardware: type 1, major 1
    IqEntry{5, 18, u32, GSV, 0x00030000},  // electronics: type 3
    IqEntry{5, 19, u8, G, 1},
    IqEntry{5, 20, u8, G, 5},  // boot loader, application
    IqEntry{5, 21, u32, G, 0x00000083},
    IqEntry{5, 22, u32, G},
    IqEntry{5, 23, u32, G, 72'000'000},
    IqEntry{5, 24, u32, G},
    IqEntry{5, 25, u32, G, 0x00010000},
    // persistent_memory
    IqEntry{11, 0, none, S},
    IqEntry{11, 1, none, S},
    IqEntry{11, 2, u32, S},
    IqEntry{11, 3, u32, S},
    // serial_interface: a set saves too
    IqEntry{16, 0, u32, GS, 115200},
    // brushless_drive
    IqEntry{50, 0, u8, G},
    IqEntry{50, 1, f32, S},
    IqEntry{50, 2, f32, S},
    IqEntry{50, 3, f32, S},
    IqEntry{50, 4, f32, S},
    IqEntry{50, 5, none, S},
    IqEntry{50, 6, none, S},
    IqEntry{50, 7, f32, G},
    IqEntry{50, 8, f32, G},
    IqEntry{50, 9, f32, G},
    IqEntry{50, 10, f32, G},
    IqEntry{50, 11, f32, G},
    IqEntry{50, 12, f32, G},
    IqEntry{50, 13, f32, G},
    IqEntry{50, 14, u16, GSV, 7},
    IqEntry{50, 15, u8, GSV, 0},
    IqEntry{50, 16, u8, GSV, 0},
    IqEntry{50, 17, f32, GSV, 1.25},
    IqEntry{50, 18, f32, GSV, 2.5e-5},
    IqEntry{50, 19, u32, GSV, 48000},
    IqEntry{50, 20, f32, GS},
    IqEntry{50, 21, f32, GS},
    IqEntry{50, 22, u8, GSV, 1},
    IqEntry{50, 23, f32, G},
    IqEntry{50, 24, f32, G},
    IqEntry{50, 25, f32, GSV, 0.5},
    IqEntry{50, 26, f32, GSV, 0.1},
    IqEntry{50, 27, f32, GSV, 10},
    IqEntry{50, 29, f32, GSV, 26},
    IqEntry{50, 32, f32, GSV, 2200},
    IqEntry{50, 33, f32, GSV, 0.045},  // motor and controller
    IqEntry{50, 34, f32, GSV, 30},
    IqEntry{50, 35, f32, GSV, 27},
    IqEntry{50, 36, f32, G},
    IqEntry{50, 37, f32, G},
    IqEntry{50, 38, f32, GSV, 3400},
    IqEntry{50, 39, f32, GSV, 3500},
    IqEntry{50, 40, f32, GSV, 1.5e-5},
    IqEntry{50, 41, i32, G, 65536},
    IqEntry{50, 42, f32, GSV, 28},
    IqEntry{50, 43, f32, GSV, 30},
    IqEntry{50, 44, f32, G},
    IqEntry{50, 45, f32, G},
    IqEntry{50, 46, f32, GSV, 500},
    IqEntry{50, 47, u8, GSV, 0},
    IqEntry{50, 61, u32, GSV, 100},
    IqEntry{50, 62, u32, GSV, 1000},
    // propeller_motor_control
    IqEntry{52, 0, i8, G, 1},
    IqEntry{52, 1, none, S},
    IqEntry{52, 2, none, S},
    IqEntry{52, 3, f32, GS, 0},
    IqEntry{52, 4, f32, GS, 0},
    IqEntry{52, 5, f32, GS, 0},
    IqEntry{52, 7, f32, GSV, 0.02},
    IqEntry{52, 8, f32, GSV, 0.9},
    IqEntry{52, 9, f32, GSV, 0},
    IqEntry{52, 10, f32, GSV, 0.006},
    IqEntry{52, 11, f32, GSV, 0.0043},
    IqEntry{52, 12, f32, GSV, 2.0e-7},
    IqEntry{52, 15, f32, GSV, 0.5},
    IqEntry{52, 16, u32, GSV, 100},
    IqEntry{52, 17, u8, GSV, 0, current},
    IqEntry{52, 18, u8, GSV, 0, current},
    IqEntry{52, 19, u8, GSV, 1, current},
    // esc_propeller_input_parser
    IqEntry{60, 0, u8, GSV, 0},
    IqEntry{60, 1, f32, GS, 0},
    IqEntry{60, 3, u8, GSV, 0},
    IqEntry{60, 4, f32, GSV, 12.6},
    IqEntry{60, 5, f32, GSV, 2800},
    IqEntry{60, 6, f32, GSV, 10},
    IqEntry{60, 7, f32, GSV, 1},
    IqEntry{60, 8, u8, GSV, 0},
    IqEntry{60, 9, f32, GSV, 0},
    IqEntry{60, 10, f32, GSV, 0.04},
    IqEntry{60, 11, u8, GSV, 0},
    // power_monitor
    IqEntry{69, 0, f32, G},
    IqEntry{69, 1, f32, G},
    IqEntry{69, 2, f32, G},
    IqEntry{69, 3, f32, G},
    IqEntry{69, 4, none, S},
    IqEntry{69, 5, u32, G, 40000},
    IqEntry{69, 6, u32, GSV, 100},
    IqEntry{69, 7, u16, G},
    IqEntry{69, 8, u16, G},
    IqEntry{69, 9, f32, GSV, 0.009},
    IqEntry{69, 10, f32, GSV, 0.03},
    IqEntry{69, 11, f32, GSV, 2048},
    IqEntry{69, 13, f32, GSV},
    IqEntry{69, 14, u32, GSV, 10},
    // temperature_monitor_uc
    IqEntry{73, 0, f32, G},
    IqEntry{73, 1, u32, G, 1000},
    IqEntry{73, 2, u32, GSV, 1},
    IqEntry{73, 3, f32, GSV, 100},
    IqEntry{73, 4, f32, GSV, 110},
    IqEntry{73, 5, f32, G, 1},
    // hobby_input: disabled, as recommended on a stand
    IqEntry{76, 0, u8, GSV, 254},
    IqEntry{76, 1, u8, GS},
    IqEntry{76, 2, u8, G},
    IqEntry{76, 3, u32, GSV, 2000},
    IqEntry{76, 4, u32, GSV, 1000},
    IqEntry{76, 5, none, S},
    IqEntry{76, 6, u16, GSV, 0},
    IqEntry{76, 7, u8, GSV, 0},
    IqEntry{76, 8, u8, GSV, 0},
    // temperature_estimator
    IqEntry{77, 0, f32, G, 0, legacy},
    IqEntry{77, 1, f32, GSV, 140, legacy},
    IqEntry{77, 2, f32, GSV, 150, legacy},
    IqEntry{77, 3, f32, GSV, 3.3, legacy},
    IqEntry{77, 4, f32, GSV, 6, legacy},
    IqEntry{77, 5, i32, G, 65536, legacy},
    // coil_temperature_estimator
    IqEntry{83, 0, f32, G, 0, current},
    IqEntry{83, 1, f32, G, 0, current},
    IqEntry{83, 2, f32, GSV, 25, current},
    IqEntry{83, 3, f32, GSV, 0.05, current},
    IqEntry{83, 4, f32, GSV, 0.25, current},
    IqEntry{83, 5, f32, G, 0, current},
    IqEntry{83, 6, f32, GSV, 6, current},
    IqEntry{83, 7, f32, GSV, 0.006, current},
    IqEntry{83, 8, f32, GSV, 140, current},
    IqEntry{83, 9, f32, GSV, 150, current},
    IqEntry{83, 10, f32, G, 1, current},
    IqEntry{83, 11, f32, G, 0, current},
    IqEntry{83, 12, f32, G, 0, current},
    IqEntry{83, 13, f32, G, 0, current},
    // power_safety
    IqEntry{84, 0, u8, G},
    IqEntry{84, 1, u8, GS},
    IqEntry{84, 2, u8, GSV, 1},
    IqEntry{84, 3, f32, GSV, 5.0},
    IqEntry{84, 4, f32, GSV, 30},
    IqEntry{84, 5, f32, GSV, 1.15},
    IqEntry{84, 6, f32, GSV, 1.25},
    IqEntry{84, 7, f32, GSV, -40},
    IqEntry{84, 8, f32, GSV, 40},
    IqEntry{84, 9, f32, GSV, -60},
    IqEntry{84, 10, f32, GSV, 60},
    IqEntry{84, 11, f32, GSV, -40},
    IqEntry{84, 12, f32, GSV, 115},
    IqEntry{84, 13, f32, GSV, -40},
    IqEntry{84, 14, f32, GSV, 160},
    // arming_handler
    IqEntry{86, 1, u8, GSV, 0},
    IqEntry{86, 2, u8, GSV, 1},
    IqEntry{86, 3, f32, GSV, 0.075},
    IqEntry{86, 4, f32, GSV, 0},
    IqEntry{86, 5, u8, GSV, 0},
    IqEntry{86, 6, f32, GSV, 0},
    IqEntry{86, 7, f32, GSV, 0},
    IqEntry{86, 8, u32, GSV, 10},
    IqEntry{86, 9, u8, GSV, 0},
    IqEntry{86, 10, u8, GSV, 0},
    IqEntry{86, 11, u8, GSV, 0},
    IqEntry{86, 12, u8, GS, 0},
    IqEntry{86, 13, u32, GSV, 10},
    IqEntry{86, 14, u8, GSV, 0},
    // stopping_handler
    IqEntry{87, 0, f32, GSV, 5},
    IqEntry{87, 1, f32, GSV, 1},
    // iquart_flight_controller_interface
    IqEntry{88, 2, u8, GSV, 255},
    IqEntry{88, 3, u8, GSV, 255},
    IqEntry{88, 4, u8, GSV, 255},
};

constexpr std::uint16_t key_of(const IqEntry& entry) noexcept { return iq_key(entry.type, entry.sub); }
static_assert(std::is_sorted(kEntries.begin(), kEntries.end(),
                             [](const IqEntry& a, const IqEntry& b) { return key_of(a) < key_of(b); }),
              "the table is searched by bisection");

double value_of(IqFormat format, std::uint32_t bits) noexcept {
  if (format == f32) return static_cast<double>(std::bit_cast<float>(bits));
  if (format == i8) return static_cast<std::int8_t>(bits);
  if (format == i32) return static_cast<std::int32_t>(bits);
  return bits;
}

/// Who the module is, not how it is set: neither reverting nor erasing touches it.
bool is_identity(const IqEntry& entry) noexcept { return entry.type == 5 && entry.sub != 14; }

}  // namespace

std::uint32_t iq_bits(IqFormat format, double value) noexcept {
  if (format == f32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

std::span<const IqEntry> iq_entries() noexcept { return kEntries; }

bool iq_present(const IqEntry& entry, const IqQuirks& quirks) noexcept {
  return entry.presence == always || (entry.presence == legacy) == quirks.legacy;
}

IqMemory::IqMemory(const IqQuirks& quirks) {
  cells_.reserve(kEntries.size());
  for (const auto& entry : kEntries) {
    const std::uint32_t bits = iq_bits(entry.format, entry.value);
    if (iq_present(entry, quirks)) cells_.push_back({entry, bits, bits});
  }
  if (quirks.legacy) provide(5, 16, 0x0010000a);  // speed 0.0.10
}

double IqMemory::Cell::value() const noexcept { return value_of(entry.format, bits); }

void IqMemory::Cell::store(double value) noexcept { bits = iq_bits(entry.format, value); }

IqMemory::Cell* IqMemory::find(std::uint8_t type, std::uint8_t sub) noexcept {
  const auto key = iq_key(type, sub);
  const auto found = std::lower_bound(cells_.begin(), cells_.end(), key, [](const Cell& cell, std::uint16_t wanted) {
    return key_of(cell.entry) < wanted;
  });
  if (found == cells_.end() || key_of(found->entry) != key) return nullptr;
  return &*found;
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
  for (Cell& cell : cells_) cell.bits = cell.saved;
}

void IqMemory::revert() noexcept {
  for (Cell& cell : cells_) {
    if (!is_identity(cell.entry)) cell.bits = cell.saved = iq_bits(cell.entry.format, cell.entry.value);
  }
}

void IqMemory::erase() noexcept {
  for (Cell& cell : cells_) {
    if (cell.entry.save() && !is_identity(cell.entry)) cell.saved = ~std::uint32_t{0};
  }
}

}  // namespace kphi::sim
