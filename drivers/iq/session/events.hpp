// Events of a module and its link, by name: they decide whether a run is valid.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "base/clock.hpp"

namespace kphi::iq {

enum class EventKind : std::uint8_t {
  connected,        ///< identity read, communication timeout set; coasting
  no_answer,        ///< it could not be connected
  module_reset,     ///< it restarted by itself: its volatile settings are lost
  module_silent,    ///< it stopped answering
  coast_denied,     ///< it did not confirm a coast
  lease_expired,    ///< no caller renewed the command in time
  port_lost,        ///< unplugged
  another_module,   ///< a different module answers now
  slow_round_trip,  ///< the median is so long that the times of readings are uncertain
  host_absent,      ///< this computer slept, or did not run kphi for so long that the module may have stopped driving
  let_go,           ///< the module has stopped driving by itself
};

[[nodiscard]] constexpr std::string_view name_of(EventKind kind) noexcept {
  constexpr std::string_view names[] = {"connected",       "no_answer",     "module_reset", "module_silent",
                                        "coast_denied",    "lease_expired", "port_lost",    "another_module",
                                        "slow_round_trip", "host_absent",   "let_go"};
  return names[static_cast<int>(kind)];
}

/// A measurement across this event is invalid.
[[nodiscard]] constexpr bool spoils_a_run(EventKind kind) noexcept {
  return kind != EventKind::connected && kind != EventKind::slow_round_trip;
}

struct Event {
  EventKind kind = EventKind::connected;
  Instant time{0};    ///< bench time at which it was noticed
  std::string words;  ///< for the log
};

}  // namespace kphi::iq
