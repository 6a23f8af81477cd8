#include "daq/device_records.hpp"

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
  }
  return MotorChannel::speed;
}

}  // namespace

results::LoadCellRecord to_record(const netbox::StampedRecord& stamped) noexcept {
  const netbox::Record& record = stamped.record;
  return {record.counts, record.rdt_sequence, record.ft_sequence, record.status, stamped.arrival.count()};
}

results::MotorReading to_reading(const iq::Reading& reading) noexcept {
  return {channel_of(reading.quantity), reading.time.count(), reading.uncertainty.count(), reading.value};
}

results::LoadCellScale to_scale(const netbox::Configuration& configuration) {
  results::LoadCellScale scale;
  scale.counts_per_newton = configuration.counts_per_newton;
  scale.counts_per_newton_metre = configuration.counts_per_newton_metre;
  scale.sample_rate_hz = configuration.rdt_rate_hz;
  scale.ft_stride = configuration.divisor;
  scale.device_rate_hz = configuration.device_rate_hz;
  scale.range = configuration.range;
  scale.serial = configuration.calibration_serial;
  scale.configuration_xml = configuration.xml;
  return scale;
}

results::SampleAccount to_account(const netbox::Counters& counters) noexcept {
  results::SampleAccount account;
  account.expected = counters.expected;
  account.received = counters.received;
  account.lost_network = counters.lost_network;
  account.lost_host = counters.lost_host;
  account.duplicates = counters.duplicates;
  account.late = counters.late;
  account.malformed = counters.malformed;
  account.restarts = counters.restarts;
  return account;
}

}  // namespace kphi::daq
