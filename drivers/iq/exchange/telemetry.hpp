// How a module is polled, and what is counted on its wire.
#pragma once

#include <cstdint>
#include <vector>

#include "base/device_data.hpp"
#include "drivers/iq/wire/packet.hpp"

namespace kphi::iq {

/// What happened on the wire. Malformed input is counted, never an error.
struct Counters : Parser::Counters {
  std::uint64_t bytes_out = 0;
  std::uint64_t resyncs = 0;  ///< frames given up because the rest did not come in time
  std::uint64_t requests = 0, replies = 0;
  std::uint64_t timeouts = 0;
  std::uint64_t late_replies = 0;        ///< came after their request had timed out; never used
  std::uint64_t unasked = 0;             ///< replies without a request, and packets that are not replies
  std::uint64_t wrong_module = 0;        ///< replies of another module id
  std::uint64_t wrong_length = 0;        ///< replies whose data has another length than the entry's format
  std::uint64_t bad_values = 0;          ///< NaN and infinity
  std::uint64_t skipped_polls = 0;       ///< due while the same question was still open
  std::uint64_t dropped_readings = 0;    ///< not taken in time
  std::uint64_t coasts = 0;              ///< coast commands given to the wire
  std::uint64_t unconfirmed_coasts = 0;  ///< times the module did not report coast after several commands
  std::uint64_t module_resets = 0;       ///< times it was seen to have restarted by itself
  std::uint64_t lease_expiries = 0;      ///< times the host's watchdog coasted the motor (Motor)
  std::uint64_t reconnections = 0;       ///< times the link was lost and found again (Motor)
};

/// How one module is polled. Times are bench time.
struct Settings {
  int module_id = 0;         ///< 0..62
  double telemetry_hz = 50;  ///< cycles per second of bench time; each asks for all of `every_cycle`
  std::vector<MotorChannel> every_cycle{MotorChannel::speed};
  double slow_hz = 0;          ///< queries per second for the other channels, in turn; 0: telemetry_hz, up to 50
  Duration reply_timeout{0};   ///< the first and the longest time-out of a request; 0: 100 ms, and Motor stretches
                               ///< it as wall time
  Duration wire_byte_time{0};  ///< 10 bits of one byte; 0: Motor takes 10/baud
  bool wire_paces = false;     ///< bytes really take that long, so a reply that arrives sooner is a duplicate; Motor:
                               ///< on an adapter, not on a pseudo-terminal
  double module_timeout_s = 0.5;  ///< the module coasts by itself after this silence; in its own seconds
  Duration longest_silence{0};    ///< the same as bench time; 0: module_timeout_s, and Motor stretches it as wall time
  bool inspects = false;  ///< only coasts and answers inquiries: sets nothing, polls nothing, does not expect the
                          ///< module to speak, is never armed. For a module that may not be fit to spin
  std::size_t credit_bytes = 63;  ///< most bytes of unanswered frames, 18 or more: the module's receive buffer has 64
};

/// With every 0 replaced as above. Throws std::invalid_argument for settings that make no sense.
[[nodiscard]] Settings completed(Settings settings);

}  // namespace kphi::iq
