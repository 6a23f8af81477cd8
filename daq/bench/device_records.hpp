// Converts the drivers' settings, counters and events to those of a run file.
#pragma once

#include <string>
#include <vector>

#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/receive/load.hpp"
#include "drivers/netbox/stream/events.hpp"
#include "results/records.hpp"

namespace kphi::daq {

[[nodiscard]] results::LoadCellScale to_scale(const netbox::Configuration& configuration);
[[nodiscard]] netbox::CellScale to_cell(const results::LoadCellScale& scale) noexcept;
[[nodiscard]] results::MotorCounts to_counts(const iq::Counters& counters) noexcept;
/// Its text is `what` behind the time. `records`: how many it is about.
[[nodiscard]] StreamEvent event_at(Instant at, EventKind kind, const std::string& what, std::uint64_t records = 0);
/// Their text begins with the time.
[[nodiscard]] std::vector<StreamEvent> to_events(const std::vector<netbox::Event>& events);
[[nodiscard]] std::vector<StreamEvent> to_events(std::vector<StreamEvent> events_of_motor);

}  // namespace kphi::daq
