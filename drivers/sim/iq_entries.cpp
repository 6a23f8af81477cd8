#include "drivers/sim/iq_entries.hpp"

#include <algorithm>
#include <array>
#include <bit>

namespace kphi::sim {
namespace {

using enum IqFormat;

constexpr bool Y = true;
constexpr bool N = false;

// type, sub, format, get, set, value. Sorted by type and sub. Values: published numbers of the 2306 where there are
// any, otherwise plausible. A row that may only be got and follows the physics holds 0 here.
constexpr std::array kEntries{
    // system_control
    IqEntry{5, 2, u16, Y, N, 0x0438},
    IqEntry{5, 3, u16, Y, N, 1},
    IqEntry{5, 4, u32, Y, N, 0x00230006},
    IqEntry{5, 5, u32, Y, N, 0x4d4b5011},
    IqEntry{5, 6, u32, Y, N, 0x20343353},
    IqEntry{5, 7, u16, Y, N, 64},
    IqEntry{5, 8, u16, Y, N, 2021},
    IqEntry{5, 9, u8, Y, N, 3},
    IqEntry{5, 10, u8, Y, N, 1},
    IqEntry{5, 11, u8, Y, N, 12},
    IqEntry{5, 12, u8, Y, N, 0},
    IqEntry{5, 13, u8, Y, N, 0},
    IqEntry{5, 14, u8, Y, Y, 0},
    IqEntry{5, 15, f32, Y, Y, 0},
    IqEntry{5, 16, u32, Y, N, 0x00100020},  // firmware: speed 0.0.32
    IqEntry{5, 17, u32, Y, N, 0x00010100},  // hardware: type 1, major 1
    IqEntry{5, 18, u32, Y, N, 0x00030000},  // electronics: type 3
    IqEntry{5, 19, u8, Y, N, 1},
    IqEntry{5, 20, u8, Y, N, 1},
    IqEntry{5, 23, u32, Y, N, 72'000'000},
    // serial_interface: the rate is reported and stored; the simulated line has none
    IqEntry{16, 0, u32, Y, Y, 115200},
    // brushless_drive
    IqEntry{50, 0, u8, Y, N, 5},
    IqEntry{50, 3, f32, N, Y, 0},
    IqEntry{50, 4, f32, N, Y, 0},
    IqEntry{50, 5, none, N, Y, 0},
    IqEntry{50, 6, none, N, Y, 0},
    IqEntry{50, 8, f32, Y, N, 0},
    IqEntry{50, 9, f32, Y, N, 0},
    IqEntry{50, 11, f32, Y, N, 0},
    IqEntry{50, 12, f32, Y, N, 0},
    IqEntry{50, 13, f32, Y, N, 0},
    IqEntry{50, 14, u16, Y, Y, 7},
    IqEntry{50, 29, f32, Y, Y, 26},
    IqEntry{50, 32, f32, Y, Y, 2200},
    IqEntry{50, 33, f32, Y, Y, 0.038},
    IqEntry{50, 34, f32, Y, Y, 30},
    IqEntry{50, 35, f32, Y, Y, 27},
    IqEntry{50, 36, f32, Y, N, 0},
    IqEntry{50, 37, f32, Y, N, 0},
    IqEntry{50, 38, f32, Y, Y, 3400},
    IqEntry{50, 39, f32, Y, Y, 3500},
    IqEntry{50, 41, u32, Y, N, 65536},
    IqEntry{50, 42, f32, Y, Y, 28},
    IqEntry{50, 43, f32, Y, Y, 30},
    IqEntry{50, 44, f32, Y, N, 0},
    // propeller_motor_control
    IqEntry{52, 0, u8, Y, N, 1},
    IqEntry{52, 1, none, N, Y, 0},
    IqEntry{52, 2, none, N, Y, 0},
    IqEntry{52, 3, f32, Y, Y, 0},
    IqEntry{52, 4, f32, Y, Y, 0},
    IqEntry{52, 5, f32, Y, Y, 0},
    IqEntry{52, 7, f32, Y, Y, 0.02},
    IqEntry{52, 8, f32, Y, Y, 0.9},
    IqEntry{52, 9, f32, Y, Y, 0},
    IqEntry{52, 10, f32, Y, Y, 0.006},
    IqEntry{52, 11, f32, Y, Y, 0.0043},
    IqEntry{52, 12, f32, Y, Y, 2.0e-7},
    IqEntry{52, 15, f32, Y, Y, 0.5},
    IqEntry{52, 16, u32, Y, Y, 100},
    IqEntry{52, 17, u8, Y, Y, 0},
    IqEntry{52, 18, u8, Y, Y, 0},
    IqEntry{52, 19, u8, Y, Y, 0},
    // power_monitor
    IqEntry{69, 0, f32, Y, N, 0},
    IqEntry{69, 1, f32, Y, N, 0},
    IqEntry{69, 2, f32, Y, N, 0},
    IqEntry{69, 3, f32, Y, N, 0},
    IqEntry{69, 4, none, N, Y, 0},
    IqEntry{69, 5, u32, Y, N, 40000},
    IqEntry{69, 6, u32, Y, Y, 100},
    // temperature_monitor_uc
    IqEntry{73, 0, f32, Y, N, 0},
    IqEntry{73, 3, f32, Y, Y, 100},
    IqEntry{73, 4, f32, Y, Y, 110},
    IqEntry{73, 5, f32, Y, N, 1},
    // hobby_input: disabled, as recommended on a stand
    IqEntry{76, 0, u8, Y, Y, 254},
    // coil_temperature_estimator
    IqEntry{83, 0, f32, Y, N, 0},
    IqEntry{83, 2, f32, Y, Y, 25},
    IqEntry{83, 3, f32, Y, Y, 0.05},
    IqEntry{83, 6, f32, Y, Y, 6},
    IqEntry{83, 7, f32, Y, Y, 0.006},
    IqEntry{83, 8, f32, Y, Y, 140},
    IqEntry{83, 9, f32, Y, Y, 150},
    IqEntry{83, 10, f32, Y, N, 1},
    // power_safety
    IqEntry{84, 0, u8, Y, N, 0},
    IqEntry{84, 1, u8, Y, Y, 0},
    IqEntry{84, 2, u8, Y, Y, 1},
    IqEntry{84, 3, f32, Y, Y, 5.0},
    IqEntry{84, 4, f32, Y, Y, 30},
    IqEntry{84, 5, f32, Y, Y, 1.15},
    IqEntry{84, 6, f32, Y, Y, 1.25},
    IqEntry{84, 7, f32, Y, Y, -40},
    IqEntry{84, 8, f32, Y, Y, 40},
    IqEntry{84, 9, f32, Y, Y, -60},
    IqEntry{84, 10, f32, Y, Y, 60},
    IqEntry{84, 11, f32, Y, Y, -40},
    IqEntry{84, 12, f32, Y, Y, 115},
    IqEntry{84, 13, f32, Y, Y, -40},
    IqEntry{84, 14, f32, Y, Y, 160},
    // arming_handler: arming gates throttle commands, of which this module takes none
    IqEntry{86, 12, u8, Y, Y, 0},
    // stopping_handler
    IqEntry{87, 0, f32, Y, Y, 5},
    IqEntry{87, 1, f32, Y, Y, 1},
};

constexpr bool before(const IqEntry& a, const IqEntry& b) noexcept {
  return iq_key(a.type, a.sub) < iq_key(b.type, b.sub);
}
static_assert(std::is_sorted(kEntries.begin(), kEntries.end(), before), "the table is searched by bisection");

std::uint32_t bits_of(IqFormat format, double value) noexcept {
  if (format == f32) return std::bit_cast<std::uint32_t>(static_cast<float>(value));
  return static_cast<std::uint32_t>(static_cast<std::int64_t>(value));
}

}  // namespace

std::span<const IqEntry> iq_entries() noexcept { return kEntries; }

IqMemory::IqMemory() {
  cells_.reserve(kEntries.size());
  for (const auto& entry : kEntries) cells_.push_back({entry, bits_of(entry.format, entry.value)});
}

IqMemory::Cell* IqMemory::find(std::uint8_t type, std::uint8_t sub) noexcept {
  const auto key = iq_key(type, sub);
  const auto found = std::lower_bound(cells_.begin(), cells_.end(), key, [](const Cell& cell, std::uint16_t wanted) {
    return iq_key(cell.entry.type, cell.entry.sub) < wanted;
  });
  if (found == cells_.end() || iq_key(found->entry.type, found->entry.sub) != key) return nullptr;
  return &*found;
}

const IqMemory::Cell* IqMemory::find(std::uint8_t type, std::uint8_t sub) const noexcept {
  return const_cast<IqMemory*>(this)->find(type, sub);
}

double IqMemory::value(std::uint8_t type, std::uint8_t sub) const noexcept {
  const Cell* cell = find(type, sub);
  if (cell == nullptr) return 0;
  if (cell->entry.format == f32) return static_cast<double>(std::bit_cast<float>(cell->bits));
  return cell->bits;
}

void IqMemory::store(std::uint8_t type, std::uint8_t sub, double value) noexcept {
  if (Cell* cell = find(type, sub)) cell->bits = bits_of(cell->entry.format, value);
}

}  // namespace kphi::sim
