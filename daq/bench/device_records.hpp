// Converts the drivers' types to those of a run file, and back where a driver's function needs records.
#pragma once

#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/events.hpp"
#include "drivers/netbox/stream/health.hpp"
#include "drivers/netbox/stream/session.hpp"
#include "results/records.hpp"

namespace kphi::daq {

[[nodiscard]] results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept;
[[nodiscard]] results::MotorReading to_reading(const iq::Reading& reading) noexcept;
[[nodiscard]] results::LoadCellScale to_scale(const netbox::Configuration& configuration);
[[nodiscard]] results::StreamEvent to_event(const netbox::Event& event);
[[nodiscard]] results::StreamEvent to_event(const iq::Event& event);
/// A motor event that spoils the run: the motor coasts already.
[[nodiscard]] bool ends_a_run(results::EventKind kind) noexcept;
/// Jitter in wall time.
[[nodiscard]] results::StreamHealth to_health(const netbox::Health& health, const Clock& clock) noexcept;
/// Samples lost by a full queue count as lost in this computer.
[[nodiscard]] results::SampleAccount to_account(const netbox::Counters& counters) noexcept;

}  // namespace kphi::daq
