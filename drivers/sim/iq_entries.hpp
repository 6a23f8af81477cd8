// The entries of the simulated module (IQ2306 2200Kv, speed firmware 0.0.32) as one table: what a GET answers, what a
// SET changes. Rows that follow the physics or start an action are treated in iq_device.cpp; all others are plain
// memory.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace kphi::sim {

enum class IqFormat : std::uint8_t { none = 0, u8 = 1, u16 = 2, u32 = 4, f32 = 5 };

/// Bytes of a value: 0, 1, 2 or 4. Signed formats are stored as their bits.
[[nodiscard]] constexpr std::size_t iq_size(IqFormat format) noexcept {
  return format == IqFormat::f32 ? 4 : static_cast<std::size_t>(format);
}

/// "client.entry" in one number, for switches.
[[nodiscard]] constexpr std::uint16_t iq_key(std::uint8_t type, std::uint8_t sub) noexcept {
  return static_cast<std::uint16_t>(type << 8 | sub);
}

struct IqEntry {
  std::uint8_t type;
  std::uint8_t sub;
  IqFormat format;
  bool get;
  bool set;
  double value;  ///< at power-up
};

[[nodiscard]] std::span<const IqEntry> iq_entries() noexcept;

/// The module's volatile memory: the bits of every entry, so that also a NaN comes back as it was sent.
class IqMemory {
 public:
  IqMemory();
  struct Cell {
    IqEntry entry;
    std::uint32_t bits;
  };
  /// nullptr: no such entry.
  [[nodiscard]] Cell* find(std::uint8_t type, std::uint8_t sub) noexcept;
  [[nodiscard]] const Cell* find(std::uint8_t type, std::uint8_t sub) const noexcept;
  [[nodiscard]] double value(std::uint8_t type, std::uint8_t sub) const noexcept;
  void store(std::uint8_t type, std::uint8_t sub, double value) noexcept;

 private:
  std::vector<Cell> cells_;
};

}  // namespace kphi::sim
