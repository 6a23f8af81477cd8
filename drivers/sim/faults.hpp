// The script of what goes wrong on the load cell's wire and in its box, as plain data. Times are bench time.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/clock.hpp"

namespace kphi::sim {

enum class FaultKind : std::uint8_t {
  // datagrams on their way to the host
  loss,            ///< a burst of `burst` datagrams is lost with probability `p` at each
  gilbert,         ///< two states: lost with probability `loss` in the bad one
  duplicate,       ///< comes twice with probability `p`, again after `delay_s`
  reorder,         ///< with probability `p` the next `depth` datagrams overtake it, within `delay_s` (0.01)
  delay,           ///< by `delay_s` and up to `jitter_s` more; the order stays
  hold,            ///< nothing arrives during for_s, then all at once
  wrong_size,      ///< with probability `p` a datagram of `size` bytes comes instead (`replaces`) or besides
  foreign_source,  ///< with probability `p` one that looks right comes besides, from another address
  // requests on their way to the box
  lost_start,
  doubled_start,  ///< again after `delay_s`
  delayed_start,  ///< by `delay_s`
  stolen,         ///< another client starts a stream
  // the box
  restart,       ///< rdt_sequence begins anew, unasked
  reboot,        ///< dead for `down_s`, then counts from 0; `resume`: streams again
  stall,         ///< ft_sequence and forces stand still
  ft_jump_back,  ///< ft_sequence falls by `samples`
  wrap,          ///< ft_sequence will wrap `samples` from now
  clock_skew,    ///< `ppm` and ±`wander_ppm` sinusoidal of period `period_s`
  status,        ///< `bits` set; `latched`: until a power cycle
  saturation,    ///< axes of mask `axes` read their full range
  units,         ///< force_unit and torque_unit by code
  // the web server
  http_slow,       ///< answers after `delay_s`
  http_truncated,  ///< only the first `size` bytes
  http_status,     ///< `code` instead of the page
  http_oversized,  ///< a page of `size` bytes
  http_refused,    ///< nobody listens
};

struct Fault {
  FaultKind kind = FaultKind::loss;
  Instant at{0};
  Duration lasts{0};        ///< 0: no end in time
  std::uint64_t count = 0;  ///< of datagrams, requests or answers that it concerns; 0: no limit
  double p = 1, p_good_bad = 0, p_bad_good = 1, loss = 1;
  std::uint64_t burst = 1, depth = 1, size = 0, samples = 1;
  Duration delay{0}, jitter{0}, down{0};
  double ppm = 0, wander_ppm = 0;
  Duration period = std::chrono::seconds(600);
  std::uint32_t bits = 0, axes = 0;
  int force_unit = 2, torque_unit = 3, code = 404;
  bool resume = false, latched = false, replaces = false, buffered = false;

  [[nodiscard]] Instant end() const noexcept { return lasts > Duration{0} ? at + lasts : kNever; }
  friend bool operator==(const Fault&, const Fault&) = default;
};

using FaultScript = std::vector<Fault>;

[[nodiscard]] std::string_view name_of(FaultKind kind) noexcept;

/// One entry of a script as a person writes it: names and values as text.
using FaultEntry = std::map<std::string, std::string>;

/// What is wrong in an entry, and at which of its keys; an empty key: the whole entry.
class FaultEntryError : public std::runtime_error {
 public:
  FaultEntryError(std::string at_key, const std::string& what) : std::runtime_error(what), key(std::move(at_key)) {}
  const std::string key;
};

/// Strict: unknown keys, keys of another kind, values out of range and missing keys throw FaultEntryError.
[[nodiscard]] Fault fault_of(const FaultEntry& entry);

}  // namespace kphi::sim
