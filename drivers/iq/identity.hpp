// Who the module is, as read at connection.
#pragma once

#include <cstdint>
#include <string>

#include "drivers/iq/codes.hpp"

namespace kphi::iq {

struct Identity {
  std::uint32_t firmware = 0;     ///< style (bits 31..20), major (19..14), minor (13..7), patch (6..0)
  std::uint32_t hardware = 0;     ///< type (bits 31..16), major (15..8), batch (7..0); 2306-2200Kv: type 1
  std::uint32_t electronics = 0;  ///< as hardware; 2306-2200Kv: type 3
  std::uint32_t uid1 = 0, uid2 = 0, uid3 = 0;
  int pole_pairs = 0;                 ///< 0: not told; 23-XX: 7
  double motor_kv_rpm_per_volt = 0;   ///< 0: not told
  int fault_now = 0;                  ///< bits of FaultBit at connection
  double timeout_s = 0;               ///< communication timeout, read back; seconds of the module
  bool timeout_behavior_set = false;  ///< false: old firmware, which always coasts and then plays its song
  int coil_temperature_client = 0;    ///< 83, 77 (old firmware), 0: none answers
  int system_control_id = 0;          ///< where system_control answers: the module's id; on old firmware always 0
  double uptime_s = -1;               ///< seconds of the module at connection; below 0: not told
  int fault_ever = -1;                ///< bits of FaultBit at connection; -1: not told

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
