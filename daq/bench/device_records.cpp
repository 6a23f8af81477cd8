#include "daq/bench/device_records.hpp"

#include <fmt/format.h>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::daq {

results::MotorCounts to_counts(const iq::Counters& counters) noexcept {
  return {counters.requests,        counters.replies,       counters.timeouts,
          counters.late_replies,    counters.unasked,       counters.crc_errors,
          counters.discarded_bytes, counters.skipped_polls, counters.dropped_readings};
}

results::LoadCellScale to_scale(const netbox::Configuration& configuration) {
  results::LoadCellScale scale;
  scale.counts_per_newton = configuration.counts_per_newton;
  scale.counts_per_newton_metre = configuration.counts_per_newton_metre;
  scale.sample_rate_hz = configuration.rdt_rate_hz;
  scale.ft_stride = configuration.divisor;
  scale.device_rate_hz = configuration.device_rate_hz;
  scale.range = configuration.range;
  scale.saturation_bits = netbox::saturation_bits(configuration.kind);
  scale.serial = configuration.calibration_serial;
  scale.configuration_xml = configuration.xml;
  return scale;
}

netbox::CellScale to_cell(const results::LoadCellScale& scale) noexcept {
  netbox::CellScale cell;
  cell.range = scale.range;
  for (std::size_t axis = 0; axis < 6; ++axis)
    cell.counts_per_unit[axis] = axis < 3 ? scale.counts_per_newton : scale.counts_per_newton_metre;
  return cell;
}

StreamEvent event_at(Instant at, EventKind kind, const std::string& what, std::uint64_t records) {
  return {kind, at.count(), records, fmt::format("{:.3f} s: {}", to_seconds(at), what)};
}

std::vector<StreamEvent> to_events(const std::vector<netbox::Event>& events) {
  std::vector<StreamEvent> out;
  for (const netbox::Event& event : events) {
    std::string text = netbox::to_string(event);
    if (event.kind == EventKind::rebooted) text += "; steps of this run without a zero taken since are flagged";
    out.push_back({event.kind, event.at.count(), event.records, std::move(text)});
  }
  return out;
}

std::vector<StreamEvent> to_events(std::vector<StreamEvent> events_of_motor) {
  for (StreamEvent& event : events_of_motor)
    event = event_at(Instant(event.time_ns), event.kind, event.text, event.records);
  return events_of_motor;
}

}  // namespace kphi::daq
