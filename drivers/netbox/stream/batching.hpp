// How many datagrams share one wake-up of the receive thread. At 7 kHz the wake-up is what a single record costs: two
// in one cost half as much, fifteen a tenth. A state machine in bench time; no I/O, one thread.
#pragma once

#include <cstdint>

#include "base/clock.hpp"

namespace kphi::netbox {

/// How long records may lie in the kernel before the receive thread takes them; their own times are the kernel's and
/// do not suffer. Datagrams further apart than that (buffered at 7 kHz: 5.7 ms) are handed over at once in all four.
enum class HandOver : std::uint8_t {
  at_once,   ///< a wake-up for each datagram
  prompt,    ///< 150 us and a wake-up's delay: at 7 kHz two single records share one while they come evenly, as a box
             ///< sends them
  gathered,  ///< 2 ms: at 7 kHz fifteen
  as_asked,  ///< prompt for who waits for them again and again, gathered for who only takes now and then
};

class Batching {
 public:
  /// `period`: between two datagrams. `bench_per_wall`: bench seconds that pass in one of a person's.
  Batching(HandOver policy, Duration period, double bench_per_wall) noexcept;
  /// Each datagram, by the kernel's stamp.
  void note(Instant arrival) noexcept {
    const Duration deviation = arrival - newest_ - period_;
    even_ = deviation < period_ / 2 && -deviation < period_ / 2 ? even_ + 1 : 0;
    newest_ = arrival;
  }
  /// From `now` until as many have come as shall share a wake-up; 0: wake up with the next. `awaited`: somebody waits
  /// for records.
  [[nodiscard]] Duration sleep_time(Instant now, bool awaited) const noexcept;

 private:
  /// Datagrams in one wake-up.
  [[nodiscard]] std::int64_t together(bool awaited) const noexcept;

  HandOver policy_;
  Duration period_, margin_;
  std::int64_t prompt_, gathered_;  // datagrams
  Instant newest_{0};
  std::uint64_t even_ = 0;  // datagrams that came one period behind the one before, in a row
};

}  // namespace kphi::netbox
