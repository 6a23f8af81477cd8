// How one module is polled. Times are bench time.
#pragma once

#include <vector>

#include "base/clock.hpp"
#include "drivers/iq/exchange/reading.hpp"

namespace kphi::iq {

struct Settings {
  int module_id = 0;         ///< 0..62
  double telemetry_hz = 50;  ///< cycles per second of bench time; each asks for all of `every_cycle`
  std::vector<Quantity> every_cycle{Quantity::speed};
  double slow_hz = 0;            ///< queries per second for the other quantities, in turn; 0: telemetry_hz, up to 50
  Duration reply_timeout{0};     ///< the first and the longest time-out of a request; 0: 100 ms, and Motor stretches
                                 ///< these as wall time
  Duration shortest_timeout{0};  ///< lower bound of the time-out after fast round trips; 0: 2/5 of reply_timeout
  Duration slow_round_trip{0};   ///< a median above this becomes an event; 0: 1/25 of reply_timeout (4 ms)
  Duration wire_byte_time{0};    ///< 10 bits of one byte; 0: Motor takes 10/baud
  bool wire_paces = false;       ///< bytes really take that long, so a reply that arrives sooner is a duplicate; Motor:
                                 ///< on an adapter, not on a pseudo-terminal
  double module_timeout_s = 0.5;  ///< the module coasts by itself after this silence; in its own seconds
  Duration longest_silence{0};    ///< the same as bench time; 0: module_timeout_s, and Motor stretches it as wall time
  std::size_t credit_bytes = 63;  ///< most bytes of unanswered frames, 18 or more: the module's receive buffer has 64
};

/// With every 0 replaced as above. Throws std::invalid_argument for settings that make no sense.
[[nodiscard]] Settings completed(Settings settings);

}  // namespace kphi::iq
