// The entries of the simulated module (IQ2306 2200Kv, speed firmware) as one table: format, access and value at the
// factory. And the module's memory: what is volatile, what is saved. Rows that follow the physics or start an
// action are treated in actions.cpp; all others are plain memory.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

namespace kphi::sim {

/// Which firmware the module has. What the documents leave open is set to the likeliest.
struct IqQuirks {
  bool legacy = false;  ///< before the coil estimator and the configurable timeout: client 77 instead of 83, and after
                        ///< a timeout the song plays until a spin or an arming
  bool system_control_on_id_zero = false;  ///< client 5 answers on module id 0 only
  bool no_power_safety = false;            ///< client 84 does not exist
  bool no_volts_limit = false;             ///< nor entry 35 of client 50
};

inline constexpr IqQuirks kLegacyFirmware{true, true};

enum class IqFormat : std::uint8_t { none, i8, u8, u16, u32, i32, f32 };

/// Bytes of a value.
[[nodiscard]] constexpr std::size_t iq_size(IqFormat format) noexcept {
  constexpr std::size_t kSizes[] = {0, 1, 1, 2, 4, 4, 4};
  return kSizes[static_cast<std::size_t>(format)];
}

/// A value as it travels, in the lowest bytes.
[[nodiscard]] std::uint32_t iq_bits(IqFormat format, double value) noexcept;

/// "client.entry" in one number, for switches.
[[nodiscard]] constexpr std::uint16_t iq_key(std::uint8_t type, std::uint8_t sub) noexcept {
  return static_cast<std::uint16_t>(type << 8 | sub);
}

/// Which firmware has a row.
enum class IqPresence : std::uint8_t { always, current, legacy };

struct IqEntry {
  std::uint8_t type;
  std::uint8_t sub;
  IqFormat format;
  std::uint8_t access;  ///< bits 0, 1, 2: get, set, save
  double value = 0;     ///< at the factory
  IqPresence presence = IqPresence::always;
  std::uint8_t count = 1;  ///< rows of the table: entries that are alike, from `sub` on

  [[nodiscard]] constexpr bool get() const noexcept { return (access & 1) != 0; }
  [[nodiscard]] constexpr bool set() const noexcept { return (access & 2) != 0; }
  [[nodiscard]] constexpr bool save() const noexcept { return (access & 4) != 0; }
};

/// Every entry of both firmwares.
[[nodiscard]] std::vector<IqEntry> iq_entries();
[[nodiscard]] bool iq_present(const IqEntry& entry, const IqQuirks& quirks) noexcept;

/// The module's memory: the bits of every entry, so that a NaN, too, comes back as it was sent.
class IqMemory {
 public:
  explicit IqMemory(const IqQuirks& quirks);
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
  /// The same, and 0 for a value that is not finite.
  [[nodiscard]] double finite(std::uint8_t type, std::uint8_t sub) const noexcept;
  void store(std::uint8_t type, std::uint8_t sub, double value) noexcept;
  /// Stores and saves.
  void provide(std::uint8_t type, std::uint8_t sub, double value) noexcept;

  void reboot() noexcept;  ///< volatile = saved

 private:
  std::map<std::uint16_t, Cell> cells_;  ///< by iq_key()
};

}  // namespace kphi::sim
