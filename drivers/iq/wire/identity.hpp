// Who the module is and how it is set: the values read from it, and its version words taken apart.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/iq/wire/entries.hpp"

namespace kphi::iq {

/// system_control.firmware_version: style (bits 31..20), major (19..14), minor (13..7), patch (6..0).
struct FirmwareVersion {
  static constexpr int kSpeed = 1;  ///< the only style that a stand can use

  int style = 0, major = 0, minor = 0, patch = 0;

  FirmwareVersion() = default;
  constexpr explicit FirmwareVersion(std::uint32_t word) noexcept
      : style(static_cast<int>(word >> 20)),
        major(static_cast<int>(word >> 14 & 0x3F)),
        minor(static_cast<int>(word >> 7 & 0x7F)),
        patch(static_cast<int>(word & 0x7F)) {}

  /// Of two of the same style.
  [[nodiscard]] constexpr bool older_than(int other_major, int other_minor, int other_patch) const noexcept {
    if (major != other_major) return major < other_major;
    return minor != other_minor ? minor < other_minor : patch < other_patch;
  }
  /// "speed 0.0.32"
  [[nodiscard]] std::string text() const;
};

/// system_control.hardware_version and electronics_version: type (bits 31..16), major (15..8), batch (7..0).
struct BoardVersion {
  static constexpr int kHardware2306 = 1;     ///< hardware type of the 2306-2200Kv; its majors are 0 and 1
  static constexpr int kElectronics2306 = 3;  ///< its electronics type

  int type = 0, major = 0, batch = 0;

  BoardVersion() = default;
  constexpr explicit BoardVersion(std::uint32_t word) noexcept
      : type(static_cast<int>(word >> 16)),
        major(static_cast<int>(word >> 8 & 0xFF)),
        batch(static_cast<int>(word & 0xFF)) {}

  /// "type 1.1 batch 0"
  [[nodiscard]] std::string text() const;
};

template <Path path>
concept Audited = Known<path> && entry<path>
.audited;

/// Values of audited entries as a module has told them, at connection or for an audit.
struct AuditRecord {
  std::map<const Entry*, double> values;  ///< in the order of their table

  /// value<"brushless_drive.volts_limit">(); nullopt: no answer, or not asked. An entry that is not audited does not
  /// compile.
  template <Path path>
  requires Audited<path>
  [[nodiscard]] std::optional<double> value() const {
    const auto found = values.find(&entry<path>);
    return found == values.end() ? std::nullopt : std::optional(found->second);
  }

  [[nodiscard]] std::optional<FirmwareVersion> firmware() const;
  [[nodiscard]] std::optional<BoardVersion> hardware() const;
  [[nodiscard]] std::optional<BoardVersion> electronics() const;
  /// 24 hexadecimal digits; empty if unknown.
  [[nodiscard]] std::string uid() const;
  /// 83 or, with old firmware, 77; 0: no answer.
  [[nodiscard]] int coil_temperature_client() const;
  /// What was read at connection, in one line for a person.
  [[nodiscard]] std::string summary() const;

  /// For the run's header: YAML, one line per known value ("brushless_drive.volts_limit: 27  # V"), starting with the
  /// decoded versions. Unknown values are left out.
  [[nodiscard]] std::string text() const;
  /// Reads text() back; other lines are skipped.
  [[nodiscard]] static AuditRecord of(std::string_view text);
};

}  // namespace kphi::iq
