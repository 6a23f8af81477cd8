// Faults of the motor's line, its module, its supply and its rotor. In a script, kinds begin with motor_; times are
// bench time.
#pragma once

#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/fault_table.hpp"

namespace kphi::sim {

enum class MotorFaultKind : std::uint8_t {
  // replies on their way to the host
  flip,          ///< `bits` bits of the frame are flipped
  bad_crc,       ///< the checksum is wrong, the rest right
  drop,          ///< the reply is not sent
  duplicate,     ///< it comes twice
  reorder,       ///< the next reply overtakes it, within `delay_s` (0.01)
  truncate,      ///< only the first `size` bytes come
  garbage,       ///< `bytes` (hex, or `size` random ones) come before it
  merge,         ///< it waits up to `delay_s` for others, then all come at once
  split,         ///< its bytes come one by one, `delay_s` apart
  stall,         ///< after `size` bytes the line stands still for `delay_s`
  delay,         ///< the module answers `delay_s` and up to `jitter_s` later; the order stays
  value,         ///< it contains `value` instead: a number, nan, inf, -inf, denormal
  wrong_length,  ///< its data has `size` bytes
  wrong_id,      ///< it comes from module `id`
  stuck,         ///< an entry repeats its value from the beginning of the fault
  // the line
  mute,          ///< nothing reaches the host
  deaf,          ///< nothing reaches the module
  command_flip,  ///< with probability `p` a bit of a byte to the module is flipped
  unplug,        ///< the adapter is gone; `other`: with another module afterwards
  // the module
  brown_out,    ///< off for `down_s`, then as after power-up
  ignore_sets,  ///< sets and saves are not heard
  baud,         ///< the module's rate is `baud` (115200)
  redline,      ///< derates from `speed_rad_s` on
  hot,          ///< `coil_celsius` and `controller_celsius` warmer
  // around it
  over_voltage,  ///< the supply gives `volts` more
  sag,           ///< the supply gives `volts` less
  locked,        ///< the rotor is held
};
inline constexpr int kMotorFaultKinds = static_cast<int>(MotorFaultKind::locked) + 1;

struct MotorFault : ScriptedFault<MotorFaultKind> {
  double p = 1;
  int type = -1, sub = -1;  ///< only replies of this entry; -1: of any
  std::uint64_t bits = 1, size = 0, id = 1, baud = 115200;
  Duration delay{0}, jitter{0}, down{0};
  double value = std::numeric_limits<double>::quiet_NaN();
  double volts = 0, coil = 0, controller = 0, speed = 0;
  std::vector<std::uint8_t> bytes;
  bool other = false;
};

using MotorFaultScript = std::vector<MotorFault>;

[[nodiscard]] const FaultTable<MotorFault>& motor_faults();
[[nodiscard]] inline std::string_view name_of(MotorFaultKind kind) noexcept { return motor_faults().name_of(kind); }
[[nodiscard]] inline MotorFault motor_fault_of(const FaultEntry& entry) { return motor_faults().read(entry); }

}  // namespace kphi::sim
