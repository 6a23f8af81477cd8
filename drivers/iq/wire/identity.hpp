// Who the module is, as read at connection, and its version words taken apart.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/iq/wire/codes.hpp"

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

struct Identity {
  std::uint32_t firmware = 0;     ///< a FirmwareVersion
  std::uint32_t hardware = 0;     ///< a BoardVersion; 2306-2200Kv: type 1
  std::uint32_t electronics = 0;  ///< a BoardVersion; 2306-2200Kv: type 3
  std::uint32_t uid1 = 0, uid2 = 0, uid3 = 0;
  int pole_pairs = 0;                 ///< 0: unknown; 23-XX: 7
  double motor_kv_rpm_per_volt = 0;   ///< 0: unknown
  int fault_now = 0;                  ///< bits of FaultBit at connection
  double timeout_s = 0;               ///< communication timeout, read back; seconds of the module
  bool timeout_behavior_set = false;  ///< false: old firmware, which always coasts and then plays its song
  int coil_temperature_client = 0;    ///< 83, 77 (old firmware), 0: none answers
  int system_control_id = 0;          ///< where system_control answers: the module's id; on old firmware always 0
  double uptime_s = -1;               ///< seconds of the module at connection; below 0: unknown
  int fault_ever = -1;                ///< bits of FaultBit at connection; -1: unknown

  [[nodiscard]] bool same_module(const Identity& other) const noexcept {
    return uid1 == other.uid1 && uid2 == other.uid2 && uid3 == other.uid3;
  }

  /// One line for a person.
  [[nodiscard]] std::string summary() const;
  /// "speed 0.0.32"
  [[nodiscard]] std::string firmware_text() const;
  /// 24 hexadecimal digits.
  [[nodiscard]] std::string uid_text() const;
};

}  // namespace kphi::iq
