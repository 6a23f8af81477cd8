// The entries of the simulated module (IQ2306 2200Kv, speed firmware) as one table: format, access, range and value
// at the factory. And the module's memory: what is volatile, what is saved. Rows that follow the physics or start an
// action are treated in iq_device.cpp; all others are plain memory.
#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "drivers/sim/iq_habits.hpp"

namespace kphi::sim {

enum class IqFormat : std::uint8_t { none, i8, u8, u16, u32, i32, f32, bytes16 };

/// Bytes of a value.
[[nodiscard]] constexpr std::size_t iq_size(IqFormat format) noexcept {
  constexpr std::size_t kSizes[] = {0, 1, 1, 2, 4, 4, 4, 16};
  return kSizes[static_cast<std::size_t>(format)];
}

/// "client.entry" in one number, for switches.
[[nodiscard]] constexpr std::uint16_t iq_key(std::uint8_t type, std::uint8_t sub) noexcept {
  return static_cast<std::uint16_t>(type << 8 | sub);
}

/// Which modules have a row.
enum class IqPresence : std::uint8_t {
  always,
  coil_estimator,
  legacy_estimator,
  lamination,
  telemetry,
  thrust,
  supply_limits,
  undocumented,
  configurable_timeout,
};

struct IqEntry {
  std::uint8_t type;
  std::uint8_t sub;
  IqFormat format;
  std::uint8_t access;  ///< bits 0, 1, 2: get, set, save
  double value = 0;     ///< at the factory
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  IqPresence presence = IqPresence::always;

  [[nodiscard]] constexpr bool get() const noexcept { return (access & 1) != 0; }
  [[nodiscard]] constexpr bool set() const noexcept { return (access & 2) != 0; }
  [[nodiscard]] constexpr bool save() const noexcept { return (access & 4) != 0; }
};

/// Every row of every personality, sorted by type and sub.
[[nodiscard]] std::span<const IqEntry> iq_entries() noexcept;
[[nodiscard]] bool iq_present(const IqEntry& entry, const IqHabits& habits) noexcept;

/// The module's memory: the bits of every entry, so that also a NaN comes back as it was sent.
class IqMemory {
 public:
  explicit IqMemory(const IqHabits& habits);
  struct Cell {
    IqEntry entry;
    std::uint32_t bits;   ///< volatile
    std::uint32_t saved;  ///< what a reboot brings back

    [[nodiscard]] double value() const noexcept;
    void store(double value) noexcept;
    void save() noexcept { saved = bits; }
  };
  /// nullptr: no such entry.
  [[nodiscard]] Cell* find(std::uint8_t type, std::uint8_t sub) noexcept;
  [[nodiscard]] const Cell* find(std::uint8_t type, std::uint8_t sub) const noexcept;
  /// 0: no such entry.
  [[nodiscard]] double value(std::uint8_t type, std::uint8_t sub) const noexcept;
  /// The same, and 0 for what is not finite.
  [[nodiscard]] double finite(std::uint8_t type, std::uint8_t sub) const noexcept;
  void store(std::uint8_t type, std::uint8_t sub, double value) noexcept;
  /// What the owner of the module once saved.
  void provide(std::uint8_t type, std::uint8_t sub, double value) noexcept;

  void reboot() noexcept;  ///< volatile = saved
  void revert() noexcept;  ///< both = factory; identity stays
  void erase() noexcept;   ///< what was saved is blank flash; identity stays

 private:
  std::vector<Cell> cells_;
};

}  // namespace kphi::sim
