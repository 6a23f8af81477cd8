// Every kind of fault that a script can cause, with its keys, by device: load cell (no prefix), motor_, supply_,
// ambient_; those that begin with usb_ only a test can cause. Times are bench time. A new kind: an enumerator here with
// its keys, a row in faults.cpp, its effect in the device, its name in the README's table.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/clock.hpp"

namespace kphi::sim {

enum class FaultKind : std::uint8_t {
  // datagrams of the load cell on their way to the host
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
  frozen,        ///< axes of mask `axes` repeat their counts; sequences and status stay healthy
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
  // replies of the motor on their way to the host
  motor_flip,          ///< `bits` bits of the frame are flipped
  motor_bad_crc,       ///< the checksum is wrong, the rest right
  motor_drop,          ///< the reply is not sent
  motor_duplicate,     ///< it comes twice
  motor_reorder,       ///< the next reply overtakes it, within `delay_s` (0.01)
  motor_truncate,      ///< only the first `size` bytes come
  motor_garbage,       ///< `bytes` (hex, or `size` random ones) come before it
  motor_merge,         ///< it waits up to `delay_s` for others, then all come at once
  motor_split,         ///< its bytes come one by one, `delay_s` apart
  motor_stall,         ///< after `size` bytes the line pauses for `delay_s`
  motor_delay,         ///< the module answers `delay_s` and up to `jitter_s` later; the order stays
  motor_value,         ///< it contains `value` instead: a number, nan, inf, -inf, denormal
  motor_wrong_length,  ///< its data has `size` bytes
  motor_wrong_id,      ///< it comes from module `id`
  motor_stuck,         ///< an entry repeats its value from the beginning of the fault
  // its line
  motor_mute,          ///< nothing reaches the host
  motor_deaf,          ///< nothing reaches the module
  motor_command_flip,  ///< with probability `p` a bit of a byte to the module is flipped
  motor_unplug,        ///< the adapter is pulled; `other`: another module answers afterwards
  // its module
  motor_brown_out,    ///< off for `down_s`, then as after power-up
  motor_ignore_sets,  ///< sets and saves are not heard
  motor_baud,         ///< the module's rate is `baud` (115200)
  motor_redline,      ///< derates from `speed_rad_s` on
  motor_hot,          ///< `coil_celsius` and `controller_celsius` warmer
  // around it
  motor_over_voltage,  ///< the supply gives `volts` more
  motor_sag,           ///< the supply gives `volts` less
  motor_locked,        ///< the rotor is held
  // replies of the supply on their way to the host, with probability `p` each
  supply_bad_crc,            ///< RTU
  supply_no_reply,           ///< the request was obeyed
  supply_deaf,               ///< the request was not even heard
  supply_truncated,          ///< only the first `size` bytes
  supply_dribble,            ///< byte by byte, `gap_s` apart
  supply_garbage,            ///< `size` bytes before the reply
  supply_wrong_slave,        ///< another sender, `slave`
  supply_wrong_transaction,  ///< TCP: the number of another request
  supply_echo,               ///< the request comes back first
  supply_late,               ///< by `delay_s`; what comes after it waits its turn
  supply_exception,          ///< `code` instead of obedience
  // the supply
  supply_ignored_writes,  ///< acknowledged, without effect
  supply_reads_as,        ///< `register` reads `value`
  supply_closed,          ///< port and connection are gone
  supply_trip,            ///< switches itself off: `code` 1 OVP, 2 OCP, 3 OPP, 4 over-heated, 5 short circuit
  supply_panel,           ///< `register` is set to `value` on the front panel, also where its keys are locked
  supply_key,             ///< its output key is pressed: switches, unless the keypad is locked
  supply_keys_free,       ///< its firmware does not lock the keypad
  supply_sag,             ///< its output falls by `volts`
  // the air sensor on USB, and an instrument there
  ambient_unplug,      ///< pulled out during for_s, then plugged in again
  ambient_no_reply,    ///< the command was obeyed, its answer never comes
  ambient_late,        ///< its answer comes after `delay_s`
  ambient_stall,       ///< the endpoint of the answers halts
  ambient_slow_close,  ///< letting its interface go takes `delay_s`
  // its bridge and bus
  ambient_nack,       ///< the address is not acknowledged
  ambient_busy,       ///< the bridge is still occupied
  ambient_stuck_bus,  ///< SDA is held low: no start condition
  // its sensor
  ambient_warm,      ///< warmer than the air by `celsius`, as beside a warm board, and drier by as much
  ambient_reads_as,  ///< `register` reads `value`, say a damaged byte of the calibration
  // only an instrument
  usb_wrong_tag,      ///< the answer has the tag of another request
  usb_empty_first,    ///< an empty packet before the answer
  usb_packets,        ///< the answer comes in packets of `size` bytes
  usb_parts,          ///< the answer comes in messages of `size` bytes, the last of them marked as the end
  usb_deaf_to_abort,  ///< it acknowledges abort and clear, and sends the old answer all the same
  usb_closed,         ///< TCP: the connection ends instead of an answer
};

/// When a fault acts, bench time, how often, and what its keys say. Those that a kind does not have keep their
/// defaults.
struct Fault {
  FaultKind kind{};
  Instant at{0};
  Duration lasts{0};        ///< 0: no end in time
  std::uint64_t count = 0;  ///< of datagrams, requests, replies or bytes that it concerns; 0: no limit

  Duration delay{0}, jitter{0}, spike{0}, down{0}, tau = std::chrono::seconds(60), period = std::chrono::seconds(600);
  double p = 1, p_good_bad = 0, p_bad_good = 1, loss = 1;
  double ppm = 0, wander_ppm = 0, amount = 0, volts = 0, coil = 0, controller = 0, speed = 0;
  double reading = std::numeric_limits<double>::quiet_NaN();  ///< `value` of a reply
  std::uint64_t burst = 1, depth = 1, size = 3, samples = 1, records = 1, bits = 1, id = 1, baud = 115200;
  std::uint32_t axes = 0, axis = 2;
  std::uint16_t address = 0, value = 0;  ///< of a register
  int force_unit = 2, torque_unit = 3, code = 2, rate_hz = 7000, slave = 2;
  int type = -1, sub = -1;  ///< only replies of this entry; -1: of any
  bool resume = false, latched = false, replaces = false, buffered = false, utf16 = false, other = false;
  std::string tag{}, ip{};
  std::vector<std::uint8_t> bytes{};

  [[nodiscard]] bool is(FaultKind what) const noexcept { return kind == what; }
  [[nodiscard]] Instant end() const noexcept { return lasts > Duration{0} ? at + lasts : kNever; }
  /// `used`: how many it has concerned so far.
  [[nodiscard]] bool active(Instant now, std::uint64_t used = 0) const noexcept {
    return now >= at && now < end() && (count == 0 || used < count);
  }
};

using FaultScript = std::vector<Fault>;

/// What a script made happen, when.
struct FaultEvent {
  Instant at{0};
  std::string what;
};

// Where a fault acts.
[[nodiscard]] constexpr bool within(FaultKind kind, FaultKind first, FaultKind last) noexcept {
  return kind >= first && kind <= last;
}
[[nodiscard]] constexpr bool on_supply(FaultKind kind) noexcept {
  return within(kind, FaultKind::supply_bad_crc, FaultKind::supply_sag);
}
[[nodiscard]] constexpr bool on_air_sensor(FaultKind kind) noexcept {
  return within(kind, FaultKind::ambient_unplug, FaultKind::ambient_reads_as);
}

/// One entry of a script: names and values as text.
using FaultEntry = std::map<std::string, std::string>;

/// What is wrong in an entry, and at which of its keys; an empty key: the whole entry.
class FaultEntryError : public std::runtime_error {
 public:
  FaultEntryError(std::string at_key, const std::string& what) : std::runtime_error(what), key(std::move(at_key)) {}
  const std::string key;
};

/// Finite, within `low` and `high`; "true" and "false" are 1 and 0, "0x1F" is 31. Throws FaultEntryError.
[[nodiscard]] double fault_number(std::string_view key, const std::string& text,
                                  double low = -std::numeric_limits<double>::max(),
                                  double high = std::numeric_limits<double>::max(), bool whole = false);

/// Strict: unknown kinds and keys, values out of range and missing keys throw FaultEntryError.
[[nodiscard]] Fault fault_of(const FaultEntry& entry);

/// As in a script; "?" for those of an instrument.
[[nodiscard]] std::string_view name_of(FaultKind kind) noexcept;

}  // namespace kphi::sim
