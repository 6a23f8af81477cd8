#include "daq/bench/device_records.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "drivers/netbox/wire/status.hpp"

namespace kphi::daq {
namespace {

template <class From, class To>
struct Pair {
  From from;
  To to;
};

/// The table's entry for `from`; `unknown` without one.
template <class From, class To, std::size_t N>
To found_in(const std::array<Pair<From, To>, N>& table, From from, To unknown) noexcept {
  for (const auto& entry : table) {
    if (entry.from == from) return entry.to;
  }
  return unknown;
}

using Channel = results::MotorChannel;
using Kind = results::EventKind;

constexpr std::array<Pair<iq::Quantity, Channel>, 9> kChannels{{
    {iq::Quantity::speed, Channel::speed},
    {iq::Quantity::supply_voltage, Channel::supply_voltage},
    {iq::Quantity::supply_current, Channel::supply_current},
    {iq::Quantity::motor_current, Channel::motor_current},
    {iq::Quantity::coil_temperature, Channel::coil_temperature},
    {iq::Quantity::derate, Channel::derate},
    {iq::Quantity::drive_mode, Channel::drive_mode},
    {iq::Quantity::drive_pwm, Channel::drive_pwm},
    {iq::Quantity::fault_now, Channel::fault_now},
}};

constexpr std::array<Pair<netbox::EventKind, Kind>, 14> kLoadCellEvents{{
    {netbox::EventKind::restarted, Kind::restarted},
    {netbox::EventKind::rebooted, Kind::rebooted},
    {netbox::EventKind::stalled, Kind::stalled},
    {netbox::EventKind::stall_ended, Kind::stall_ended},
    {netbox::EventKind::silent, Kind::silent},
    {netbox::EventKind::resumed, Kind::resumed},
    {netbox::EventKind::box_trouble, Kind::box_trouble},
    {netbox::EventKind::taken_over, Kind::taken_over},
    {netbox::EventKind::rdt_disabled, Kind::rdt_disabled},
    {netbox::EventKind::unreachable, Kind::unreachable},
    {netbox::EventKind::unusable, Kind::unusable},
    {netbox::EventKind::reconnected, Kind::reconnected},
    {netbox::EventKind::configuration_changed, Kind::configuration_changed},
    {netbox::EventKind::given_up, Kind::given_up},
}};

constexpr std::array<Pair<iq::EventKind, Kind>, 11> kMotorEvents{{
    {iq::EventKind::connected, Kind::motor_connected},
    {iq::EventKind::no_answer, Kind::motor_no_answer},
    {iq::EventKind::module_reset, Kind::motor_reset},
    {iq::EventKind::module_silent, Kind::motor_silent},
    {iq::EventKind::coast_denied, Kind::motor_coast_denied},
    {iq::EventKind::lease_expired, Kind::motor_lease_expired},
    {iq::EventKind::port_lost, Kind::motor_port_lost},
    {iq::EventKind::another_module, Kind::motor_another_module},
    {iq::EventKind::slow_round_trip, Kind::motor_slow_round_trip},
    {iq::EventKind::host_absent, Kind::motor_host_absent},
    {iq::EventKind::let_go, Kind::motor_let_go},
}};

}  // namespace

results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept {
  const netbox::Record& record = stamped.record;
  return {record.counts, record.rdt_sequence, record.ft_sequence, record.status, stamped.arrival.count()};
}

results::MotorReading to_reading(const iq::Reading& reading) noexcept {
  return {found_in(kChannels, reading.quantity, Channel::speed), reading.time.count(), reading.uncertainty.count(),
          reading.value};
}

netbox::StampedRecord to_stamped(const results::LoadCellRecord& record) noexcept {
  return {{record.rdt_sequence, record.ft_sequence, record.status, record.counts}, Instant(record.arrival_ns)};
}

results::StreamEvent to_event(const netbox::Event& event) {
  std::string text = netbox::to_string(event);
  if (event.kind == netbox::EventKind::rebooted) text += "; the steps that follow in this run are flagged";
  return {found_in(kLoadCellEvents, event.kind, Kind::box_trouble), event.at.count(), event.records, std::move(text)};
}

results::StreamEvent to_event(const iq::Event& event) {
  // An unknown kind is treated as the worst.
  const Kind kind = found_in(kMotorEvents, event.kind, Kind::motor_silent);
  return {kind, event.time.count(), 0, fmt::format("{:.3f} s: {}", to_seconds(event.time), event.words)};
}

bool ends_a_run(results::EventKind kind) noexcept {
  return std::any_of(kMotorEvents.begin(), kMotorEvents.end(),
                     [&](const auto& each) { return each.to == kind && iq::spoils_a_run(each.from); });
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
