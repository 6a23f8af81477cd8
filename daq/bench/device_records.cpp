#include "daq/bench/device_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::daq {
namespace {

using enum results::EventKind;

/// In the order of netbox::EventKind.
constexpr std::array kLoadCellEvents{
    restarted,   rebooted, stalled,     stall_ended,           silent,  resumed, box_trouble, taken_over, rdt_disabled,
    unreachable, unusable, reconnected, configuration_changed, given_up};
static_assert(kLoadCellEvents.size() == 1 + static_cast<std::size_t>(netbox::EventKind::given_up));

/// In the order of iq::EventKind.
constexpr std::array kMotorEvents{motor_connected,       motor_no_answer,     motor_reset,     motor_silent,
                                  motor_coast_denied,    motor_lease_expired, motor_port_lost, motor_another_module,
                                  motor_slow_round_trip, motor_host_absent,   motor_let_go};
static_assert(kMotorEvents.size() == 1 + static_cast<std::size_t>(iq::EventKind::let_go));

static_assert(
    [] {
      for (std::size_t i = 0; i < results::kMotorChannels.size(); ++i) {
        if (iq::name_of(static_cast<iq::Quantity>(i)) != results::kMotorChannels[i].name) return false;
      }
      return true;
    }(),
    "iq::Quantity and results::MotorChannel are the same, in the same order");

}  // namespace

results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept {
  const netbox::Record& record = stamped.record;
  return {record.counts, record.rdt_sequence, record.ft_sequence, record.status, stamped.arrival.count()};
}

results::MotorReading to_record(const iq::Reading& reading) noexcept {
  return {static_cast<results::MotorChannel>(reading.quantity), reading.time.count(), reading.uncertainty.count(),
          reading.value};
}

results::SupplyReading to_record(const supply::Reading& reading) noexcept {
  // The drivers' enums have the codes of the file: see the assertions.
  static_assert(static_cast<int>(supply::Protection::unknown) == static_cast<int>(results::SupplyProtection::unknown));
  static_assert(static_cast<int>(supply::Regulation::unknown) == static_cast<int>(results::SupplyRegulation::unknown));
  return {reading.at.count(),
          reading.uncertainty.count(),
          reading.voltage_v,
          reading.current_a,
          reading.set_voltage_v,
          reading.current_limit_a,
          static_cast<results::SupplyRegulation>(reading.regulation),
          static_cast<results::SupplyProtection>(reading.protection),
          reading.output ? 1u : 0u};
}

results::StreamEvent to_event(const netbox::Event& event) {
  std::string text = netbox::to_string(event);
  if (event.kind == netbox::EventKind::rebooted) text += "; the steps that follow in this run are flagged";
  return {kLoadCellEvents[static_cast<std::size_t>(event.kind)], event.at.count(), event.records, std::move(text)};
}

results::StreamEvent to_event(const iq::Event& event) {
  return {kMotorEvents[static_cast<std::size_t>(event.kind)], event.time.count(), 0,
          fmt::format("{:.3f} s: {}", to_seconds(event.time), event.words)};
}

bool ends_a_run(results::EventKind kind) noexcept {
  const auto found = std::ranges::find(kMotorEvents, kind);
  return found != kMotorEvents.end() && iq::spoils_a_run(static_cast<iq::EventKind>(found - kMotorEvents.begin()));
}

results::StreamHealth to_health(const netbox::Health& health, const Clock& clock) noexcept {
  results::StreamHealth out;
  out.records_per_second = health.records_per_second;
  out.datagrams_per_second = health.datagrams_per_second;
  out.jitter_p50_s = to_seconds(clock.shrunk(Duration(health.jitter_p50_ns)));
  out.jitter_p99_s = to_seconds(clock.shrunk(Duration(health.jitter_p99_ns)));
  out.skew_ppm = health.skew_ppm;
  out.clock_uncertainty_s = to_seconds(Duration(health.clock_uncertainty_ns));
  out.queue_high_water = health.queue_high_water;
  out.events_dropped = health.events_dropped;
  return out;
}

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

results::SampleAccount to_account(const netbox::Counters& counters) noexcept {
  results::SampleAccount account;
  account.expected = counters.expected;
  account.received = counters.received - counters.queue_overflows;
  account.lost_network = counters.lost_network;
  account.lost_host = counters.lost_host + counters.queue_overflows;
  account.duplicates = counters.duplicates;
  account.late = counters.late;
  account.malformed = counters.malformed;
  account.restarts = counters.restarts;
  account.reboots = counters.reboots;
  account.reordered = counters.reordered;
  account.stalled = counters.stalled;
  account.irregular = counters.irregular;
  return account;
}

}  // namespace kphi::daq
