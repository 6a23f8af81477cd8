// From what the drivers say to what a run file holds, and back where a driver's part looks at records.
#pragma once

#include "drivers/iq/event.hpp"
#include "drivers/iq/reading.hpp"
#include "drivers/netbox/configuration.hpp"
#include "drivers/netbox/events.hpp"
#include "drivers/netbox/health.hpp"
#include "drivers/netbox/session.hpp"
#include "results/records.hpp"

namespace kphi::daq {

[[nodiscard]] results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept;
[[nodiscard]] netbox::StampedRecord to_stamped(const results::LoadCellRecord& record) noexcept;
[[nodiscard]] results::MotorReading to_reading(const iq::Reading& reading) noexcept;
[[nodiscard]] results::LoadCellScale to_scale(const netbox::Configuration& configuration);
/// Counts per unit and ranges only.
[[nodiscard]] netbox::Configuration to_configuration(const results::LoadCellScale& scale);
[[nodiscard]] results::StreamEvent to_event(const netbox::Event& event);
[[nodiscard]] results::StreamEvent to_event(const iq::Event& event);
/// Of the motor, and so that nothing measured across it can be believed: the motor has been let go already.
[[nodiscard]] bool ends_a_run(results::EventKind kind) noexcept;
/// Jitter as the clock on the wall runs.
[[nodiscard]] results::StreamHealth to_health(const netbox::Health& health, const Clock& clock) noexcept;
/// What a full queue lost counts as lost in this host.
[[nodiscard]] results::SampleAccount to_account(const netbox::Counters& counters) noexcept;

}  // namespace kphi::daq
