// Every kind of fault that a script can cause, with its keys, by device: load cell (no prefix), motor_, supply_,
// ambient_. Times are bench time. A new kind: an enumerator here with its keys, a row in faults.cpp, its effect in the
// device, its name in the README's table.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "base/clock.hpp"
#include "drivers/sim/script/fault_table.hpp"

namespace kphi::sim {

enum class FaultKind : std::uint8_t {
  // datagrams on their way to the host
  loss,            ///< a burst of `burst` datagrams is lost with probability `p` at each
  gilbert,         ///< two states: lost with probability `loss` in the bad one
  duplicate,       ///< comes twice with probability `p`, again after `delay_s`
  reorder,         ///< with probability `p` the next `depth` datagrams overtake it, within `delay_s` (0.01)
  delay,           ///< by `delay_s` and up to `jitter_s` more; the order stays
  jitter,          ///< exponential of mean `mean_s`, with probability `p` up to `spike_s` more; the order stays
  hold,            ///< nothing arrives during for_s, then all at once
  wrong_size,      ///< with probability `p` a datagram of `size` bytes comes instead (`replaces`) or in addition
  short_block,     ///< with probability `p` the box leaves out the last `records` of a datagram, all but one at most
  foreign_source,  ///< with probability `p` a plausible one from another address comes in addition
  // requests on their way to the box
  lost_start,
  doubled_start,  ///< again after `delay_s`
  delayed_start,  ///< by `delay_s`
  taken_over,     ///< another client starts a stream
  // the box
  restart,       ///< rdt_sequence restarts without a request
  reboot,        ///< dead for `down_s`, then counts from 0; `resume`: streams again
  stall,         ///< ft_sequence and forces stand still
  ft_jump_back,  ///< ft_sequence falls by `samples`
  overrun,       ///< ft_sequence leaves out `samples` between two records of one stream
  wrap,          ///< ft_sequence will wrap `samples` from now
  clock_skew,    ///< `ppm` and ±`wander_ppm` sinusoidal of period `period_s`
  status,        ///< `bits` set; `latched`: until a power cycle
  saturation,    ///< axes of mask `axes` read their full range
  units,         ///< force_unit and torque_unit by code
  rate,          ///< comrdtrate becomes `rate_hz`; what that does to the stream: NetBoxQuirks::rate_write
  zero_drift,    ///< the zero of `axis` moves by `amount` (N, N m) with the time constant `tau_s`
  address,       ///< DHCP gives the box the IPv4 address `address`
  // the web server
  http_slow,           ///< answers after `delay_s`
  http_truncated,      ///< only the first `size` bytes
  http_status,         ///< `code` instead of the page
  http_oversized,      ///< a page of `size` bytes
  http_charset,        ///< a Latin-1 letter in a page that says UTF-8; `utf16`: the whole page in UTF-16
  http_missing_tag,    ///< without the element `tag`
  http_duplicate_tag,  ///< with the element `tag` twice
  http_refused,        ///< the port is closed
  // the 16-bit interface
  tcp_split,   ///< answers in segments of `size` bytes, `delay_s` (0.002) between two
  tcp_merged,  ///< answers wait for `delay_s` and leave in one segment
  tcp_short,   ///< only the first `size` bytes, then the connection ends
};

/// Members are named after the keys above; those that a kind does not have keep their defaults.
struct Fault : ScriptedFault<FaultKind> {
  double p = 1, p_good_bad = 0, p_bad_good = 1, loss = 1;
  std::uint64_t burst = 1, depth = 1, size = 0, samples = 1, records = 1;
  Duration delay{0}, jitter{0}, spike{0}, down{0}, tau = std::chrono::seconds(60);
  double ppm = 0, wander_ppm = 0, amount = 0;
  Duration period = std::chrono::seconds(600);
  std::uint32_t bits = 0, axes = 0, axis = 2;
  int force_unit = 2, torque_unit = 3, code = 404, rate_hz = 7000;
  bool resume = false, latched = false, replaces = false, buffered = false, utf16 = false;
  std::string tag, address;
};

using FaultScript = std::vector<Fault>;

[[nodiscard]] const FaultTable<Fault>& load_cell_faults();
[[nodiscard]] inline std::string_view name_of(FaultKind kind) noexcept { return load_cell_faults().name_of(kind); }
[[nodiscard]] inline Fault fault_of(const FaultEntry& entry) { return load_cell_faults().read(entry); }

// Where a fault acts.
[[nodiscard]] constexpr bool on_datagrams(FaultKind kind) noexcept { return kind <= FaultKind::foreign_source; }
[[nodiscard]] constexpr bool on_starts(FaultKind kind) noexcept {
  return kind >= FaultKind::lost_start && kind <= FaultKind::delayed_start;
}
[[nodiscard]] constexpr bool on_box(FaultKind kind) noexcept {
  return kind >= FaultKind::taken_over && kind <= FaultKind::address;
}
[[nodiscard]] constexpr bool on_pages(FaultKind kind) noexcept {
  return kind >= FaultKind::http_slow && kind <= FaultKind::http_duplicate_tag;
}
[[nodiscard]] constexpr bool on_tcp(FaultKind kind) noexcept { return kind >= FaultKind::tcp_split; }

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
  stall,         ///< after `size` bytes the line pauses for `delay_s`
  delay,         ///< the module answers `delay_s` and up to `jitter_s` later; the order stays
  value,         ///< it contains `value` instead: a number, nan, inf, -inf, denormal
  wrong_length,  ///< its data has `size` bytes
  wrong_id,      ///< it comes from module `id`
  stuck,         ///< an entry repeats its value from the beginning of the fault
  // the line
  mute,          ///< nothing reaches the host
  deaf,          ///< nothing reaches the module
  command_flip,  ///< with probability `p` a bit of a byte to the module is flipped
  unplug,        ///< the adapter is pulled; `other`: another module answers afterwards
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

enum class SupplyFaultKind : std::uint8_t {
  // replies on their way to the host, with probability `p` each
  bad_crc,            ///< RTU
  no_reply,           ///< the request was obeyed
  deaf,               ///< the request was not even heard
  truncated,          ///< only the first `size` bytes
  dribble,            ///< byte by byte, `gap_s` apart
  garbage,            ///< `size` bytes before the reply
  wrong_slave,        ///< another sender, `slave`
  wrong_transaction,  ///< TCP: the number of another request
  echo,               ///< the request comes back first
  late,               ///< by `delay_s`; what comes after it waits its turn
  exception,          ///< `code` instead of obedience
  // the device
  ignored_writes,  ///< acknowledged, without effect
  reads_as,        ///< `register` reads `value`
  closed,          ///< port and connection are gone
  trip,            ///< switches itself off: `code` 1 OVP, 2 OCP, 3 OPP, 4 over-heated, 5 short circuit
  panel,           ///< `register` is set to `value` on the front panel
  sag,             ///< its output falls by `volts`
};

struct SupplyFault : ScriptedFault<SupplyFaultKind> {
  double p = 1;
  std::uint64_t size = 3;
  Duration delay{0};
  int slave = 2, code = 2;
  std::uint16_t address = 0, value = 0;  ///< of a register
  double volts = 0;
};

using SupplyFaultScript = std::vector<SupplyFault>;

[[nodiscard]] const FaultTable<SupplyFault>& supply_faults();

enum class UsbFaultKind : std::uint8_t {
  unplug,    ///< pulled out during for_s, then plugged in again
  no_reply,  ///< the command was obeyed, its answer never comes
  late,      ///< its answer comes after `delay_s`
  stall,     ///< the endpoint of the answers halts
  // the bridge and its bus
  nack,       ///< the address is not acknowledged
  busy,       ///< the bridge is still occupied
  stuck_bus,  ///< SDA is held low: no start condition
  // the sensor
  reads_as,  ///< `register` reads `value`, say a damaged byte of the calibration
  // the instrument
  wrong_tag,      ///< the answer has the tag of another request
  empty_first,    ///< an empty packet before the answer
  packets,        ///< the answer comes in packets of `size` bytes
  parts,          ///< the answer comes in messages of `size` bytes, the last of them marked as the end
  deaf_to_abort,  ///< it acknowledges abort and clear, and sends the old answer all the same
  closed,         ///< TCP: the connection ends instead of an answer
};

struct UsbFault : ScriptedFault<UsbFaultKind> {
  Duration delay{0};
  std::uint64_t size = 16;
  std::uint8_t address = 0, value = 0;  ///< of a register
};

using UsbFaultScript = std::vector<UsbFault>;

/// Of the air sensor and its bridge; a script cannot have those of an instrument.
[[nodiscard]] const FaultTable<UsbFault>& ambient_faults();

}  // namespace kphi::sim
