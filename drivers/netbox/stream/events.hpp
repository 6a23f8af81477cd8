// Events of the stream, with the sequence numbers that showed them. Values only; one thread per log.
#pragma once

#include <cstdint>
#include <string>

#include "base/device_data.hpp"
#include "drivers/netbox/configuration/configuration.hpp"

namespace kphi::netbox {

struct Event {
  EventKind kind = EventKind::silent;
  Instant at{0};                                    ///< bench time
  std::uint32_t rdt = 0, ft = 0;                    ///< of the record that showed it
  std::uint32_t previous_rdt = 0, previous_ft = 0;  ///< of the accepted record before
  std::uint64_t records = 0;                        ///< missing before it; of a stall: repeated
  std::uint32_t status = 0;                         ///< of box_trouble
  Changes changes = 0;                              ///< of configuration_changed
};

/// One line: "12.345 s: the stream restarted (rdt 1 after 2000, ft 5100 after 5099), 0 records missing".
[[nodiscard]] std::string to_string(const Event& event);

}  // namespace kphi::netbox
