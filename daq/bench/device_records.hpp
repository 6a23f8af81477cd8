// Converts the drivers' types to those of a run file, and back where a driver's function needs records.
#pragma once

#include <span>
#include <vector>

#include "drivers/iq/exchange/telemetry.hpp"
#include "drivers/netbox/configuration/configuration.hpp"
#include "drivers/netbox/stream/events.hpp"
#include "drivers/netbox/stream/health.hpp"
#include "drivers/netbox/stream/session.hpp"
#include "drivers/supply/supply.hpp"
#include "results/records.hpp"

namespace kphi::daq {

[[nodiscard]] results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept;
[[nodiscard]] results::MotorReading to_record(const iq::Reading& reading) noexcept;
[[nodiscard]] results::SupplyReading to_record(const supply::Reading& reading) noexcept;
[[nodiscard]] results::LoadCellScale to_scale(const netbox::Configuration& configuration);
[[nodiscard]] results::StreamEvent to_event(const netbox::Event& event);
[[nodiscard]] results::StreamEvent to_event(const iq::Event& event);

/// Moves the driver's oldest readings to `out`, converted; returns how many. `batch` is working memory.
template <class Driver, class Theirs, class Ours>
std::size_t take_records(Driver& driver, std::vector<Theirs>& batch, std::span<Ours> out) {
  batch.resize(out.size());
  const std::size_t n = driver.take(batch);
  for (std::size_t i = 0; i < n; ++i) out[i] = to_record(batch[i]);
  return n;
}
template <class Event>
[[nodiscard]] std::vector<results::StreamEvent> to_events(const std::vector<Event>& events) {
  std::vector<results::StreamEvent> out;
  for (const Event& event : events) out.push_back(to_event(event));
  return out;
}
/// A motor event that spoils the run: the motor coasts already.
[[nodiscard]] bool ends_a_run(results::EventKind kind) noexcept;
/// Jitter in wall time.
[[nodiscard]] results::StreamHealth to_health(const netbox::Health& health, const Clock& clock) noexcept;
[[nodiscard]] results::MotorCounts to_counts(const iq::Counters& counters) noexcept;
/// Samples lost by a full queue count as lost in this computer.
[[nodiscard]] results::SampleAccount to_account(const netbox::Counters& counters) noexcept;

}  // namespace kphi::daq
