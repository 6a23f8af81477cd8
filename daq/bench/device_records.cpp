#include "daq/bench/device_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::daq {
namespace {

results::MotorChannel channel_of(iq::Quantity quantity) noexcept {
  using results::MotorChannel;
  switch (quantity) {
    case iq::Quantity::speed:
      return MotorChannel::speed;
    case iq::Quantity::supply_voltage:
      return MotorChannel::supply_voltage;
    case iq::Quantity::supply_current:
      return MotorChannel::supply_current;
    case iq::Quantity::motor_current:
      return MotorChannel::motor_current;
    case iq::Quantity::coil_temperature:
      return MotorChannel::coil_temperature;
    case iq::Quantity::derate:
      return MotorChannel::derate;
    case iq::Quantity::drive_mode:
      return MotorChannel::drive_mode;
    case iq::Quantity::drive_pwm:
      return MotorChannel::drive_pwm;
    case iq::Quantity::fault_now:
      return MotorChannel::fault_now;
  }
  return MotorChannel::speed;
}

results::EventKind event_kind_of(netbox::EventKind kind) noexcept {
  using From = netbox::EventKind;
  using To = results::EventKind;
  switch (kind) {
    case From::restarted:
      return To::restarted;
    case From::rebooted:
      return To::rebooted;
    case From::stalled:
      return To::stalled;
    case From::stall_ended:
      return To::stall_ended;
    case From::silent:
      return To::silent;
    case From::resumed:
      return To::resumed;
    case From::box_trouble:
      return To::box_trouble;
    case From::taken_over:
      return To::taken_over;
    case From::rdt_disabled:
      return To::rdt_disabled;
    case From::unreachable:
      return To::unreachable;
    case From::unusable:
      return To::unusable;
    case From::reconnected:
      return To::reconnected;
    case From::configuration_changed:
      return To::configuration_changed;
    case From::given_up:
      return To::given_up;
  }
  return To::box_trouble;
}

struct MotorEvent {
  iq::EventKind from;
  results::EventKind to;
};

constexpr std::array kMotorEvents{
    MotorEvent{iq::EventKind::connected, results::EventKind::motor_connected},
    MotorEvent{iq::EventKind::no_answer, results::EventKind::motor_no_answer},
    MotorEvent{iq::EventKind::module_reset, results::EventKind::motor_reset},
    MotorEvent{iq::EventKind::module_silent, results::EventKind::motor_silent},
    MotorEvent{iq::EventKind::coast_denied, results::EventKind::motor_coast_denied},
    MotorEvent{iq::EventKind::lease_expired, results::EventKind::motor_lease_expired},
    MotorEvent{iq::EventKind::port_lost, results::EventKind::motor_port_lost},
    MotorEvent{iq::EventKind::another_module, results::EventKind::motor_another_module},
    MotorEvent{iq::EventKind::slow_round_trip, results::EventKind::motor_slow_round_trip},
    MotorEvent{iq::EventKind::host_absent, results::EventKind::motor_host_absent},
    MotorEvent{iq::EventKind::let_go, results::EventKind::motor_let_go},
};

}  // namespace

results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept {
  const netbox::Record& record = stamped.record;
  return {record.counts, record.rdt_sequence, record.ft_sequence, record.status, stamped.arrival.count()};
}

results::MotorReading to_reading(const iq::Reading& reading) noexcept {
  return {channel_of(reading.quantity), reading.time.count(), reading.uncertainty.count(), reading.value};
}

netbox::StampedRecord to_stamped(const results::LoadCellRecord& record) noexcept {
  return {{record.rdt_sequence, record.ft_sequence, record.status, record.counts}, Instant(record.arrival_ns)};
}

results::StreamEvent to_event(const netbox::Event& event) {
  std::string text = netbox::to_string(event);
  if (event.kind == netbox::EventKind::rebooted) text += "; the steps that follow in this run are flagged";
  return {event_kind_of(event.kind), event.at.count(), event.records, std::move(text)};
}

results::StreamEvent to_event(const iq::Event& event) {
  const auto* known = std::find_if(kMotorEvents.begin(), kMotorEvents.end(),
                                   [&](const MotorEvent& each) { return each.from == event.kind; });
  // An unknown kind is treated as the worst.
  const auto kind = known != kMotorEvents.end() ? known->to : results::EventKind::motor_silent;
  return {kind, event.time.count(), 0, fmt::format("{:.3f} s: {}", to_seconds(event.time), event.words)};
}

bool ends_a_run(results::EventKind kind) noexcept {
  return std::any_of(kMotorEvents.begin(), kMotorEvents.end(),
                     [&](const MotorEvent& each) { return each.to == kind && iq::spoils_a_run(each.from); });
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

netbox::Configuration to_configuration(const results::LoadCellScale& scale) {
  netbox::Configuration configuration;
  configuration.counts_per_newton = scale.counts_per_newton;
  configuration.counts_per_newton_metre = scale.counts_per_newton_metre;
  configuration.range = scale.range;
  return configuration;
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
