// Faults of the load cell's wire and its box. Times are bench time.
#pragma once

#include <array>
#include <cstdint>
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
  wrong_size,      ///< with probability `p` a datagram of `size` bytes comes instead (`replaces`) or besides
  short_block,     ///< with probability `p` the box leaves out the last `records` of a datagram, all but one at most
  foreign_source,  ///< with probability `p` one that looks right comes besides, from another address
  // requests on their way to the box
  lost_start,
  doubled_start,  ///< again after `delay_s`
  delayed_start,  ///< by `delay_s`
  taken_over,     ///< another client starts a stream
  // the box
  restart,       ///< rdt_sequence begins anew, unasked
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
  http_refused,        ///< nobody listens
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

}  // namespace kphi::sim
