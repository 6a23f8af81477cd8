// Events of the stream, with the sequence numbers that showed them. Values only; one thread per log.
#pragma once

#include <cstdint>
#include <string>

#include "base/clock.hpp"
#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

enum class EventKind : std::uint8_t {
  restarted,     ///< rdt_sequence restarted, ft_sequence continued: a repeated start, or one from another client
  rebooted,      ///< ft_sequence restarted: bias and scale may have changed
  stalled,       ///< new records repeat one measurement
  stall_ended,   ///< `records` were repeated
  silent,        ///< no record for longer than the silence timeout
  resumed,       ///< records arrive again after a silence
  box_trouble,   ///< status bit 20 (RDT) or 22 (network) was set: the box reports failed communication
  taken_over,    ///< silence, but the box answers and RDT is enabled: another client has the stream
  rdt_disabled,  ///< silence, and RDT is disabled on the box
  unreachable,   ///< silence, and the box does not answer over HTTP either
  unusable,      ///< silence or a boot, and the box's configuration is unusable
  reconnected,   ///< the stream was started again after a silence
  configuration_changed,  ///< `changes` since the silence or boot before: the records may have another meaning
  given_up,               ///< no reconnection within a minute
};

struct Event {
  EventKind kind = EventKind::silent;
  Instant at{0};                                    ///< bench time
  std::uint32_t rdt = 0, ft = 0;                    ///< of the record that showed it
  std::uint32_t previous_rdt = 0, previous_ft = 0;  ///< of the accepted record before
  std::uint64_t records = 0;                        ///< missing before it; of a stall: repeated
  std::uint32_t status = 0;                         ///< of box_trouble
  Changes changes = 0;                              ///< of configuration_changed
  friend bool operator==(const Event&, const Event&) = default;
};

/// One line: "12.345 s: the stream restarted (rdt 1 after 2000, ft 5100 after 5099), 0 records missing".
[[nodiscard]] std::string to_string(const Event& event);

}  // namespace kphi::netbox
