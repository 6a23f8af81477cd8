#include "drivers/netbox/wire/status.hpp"

#include <algorithm>
#include <span>

namespace kphi::netbox {
namespace {

struct Entry {
  constexpr Entry(StatusBit b, const char* n) : bit(static_cast<int>(b)), name(n) {}
  constexpr Entry(AxiaStatusBit b, const char* n) : bit(static_cast<int>(b)), name(n) {}
  int bit;
  const char* name;
};

constexpr Entry kNetBox[] = {
    {StatusBit::cpu_or_ram, "CPU or RAM error"},
    {StatusBit::digital_board, "digital board error"},
    {StatusBit::analog_board, "analog board error"},
    {StatusBit::serial_link, "serial link communication error"},
    {StatusBit::program_memory, "program memory verification error"},
    {StatusBit::halted, "halted: configuration errors"},
    {StatusBit::settings_validation, "settings validation error"},
    {StatusBit::calibration_mismatch, "configuration incompatible with calibration"},
    {StatusBit::network, "network communication failure"},
    {StatusBit::can, "CAN communication error"},
    {StatusBit::rdt, "RDT communication error"},
    {StatusBit::ethernet_ip, "EtherNet/IP failure"},
    {StatusBit::device_net, "DeviceNet failure"},
    {StatusBit::saturation, "transducer saturation or A/D error"},
    {StatusBit::monitor_condition, "monitor condition latched"},
    {StatusBit::watchdog, "watchdog timeout"},
    {StatusBit::stack_check, "stack check error"},
    {StatusBit::serial_eeprom, "serial EEPROM (I2C) failure"},
    {StatusBit::serial_flash, "serial flash (SPI) failure"},
    {StatusBit::analog_watchdog, "analog board watchdog timeout"},
    {StatusBit::excitation_high, "excessive strain gage excitation current"},
    {StatusBit::excitation_low, "insufficient strain gage excitation current"},
    {StatusBit::analog_ground, "artificial analog ground out of range"},
    {StatusBit::analog_supply_high, "analog supply too high"},
    {StatusBit::analog_supply_low, "analog supply too low"},
    {StatusBit::serial_link_unavailable, "serial link data unavailable"},
    {StatusBit::reference_voltage, "reference voltage or power monitor error"},
    {StatusBit::temperature, "internal temperature error"},
    {StatusBit::http_failure, "HTTP protocol failure"},
};

constexpr Entry kAxia[] = {
    {AxiaStatusBit::out_of_range, "force or torque out of range"},
    {AxiaStatusBit::calibration_checksum, "calibration checksum error"},
    {AxiaStatusBit::simulated_error, "simulated error"},
    {AxiaStatusBit::gage_out_of_range, "gage out of range"},
    {AxiaStatusBit::monitor_condition, "monitor condition latched"},
    {AxiaStatusBit::calibration_not_accessible, "calibration not accessible"},
    {AxiaStatusBit::common_error, "common error"},
    {AxiaStatusBit::busy, "busy with its memory, filter or calibration"},
    {AxiaStatusBit::broken_gage, "broken gage"},
    {AxiaStatusBit::supply_voltage, "supply voltage error"},
    {AxiaStatusBit::temperature, "temperature error"},
};

constexpr std::uint32_t mask(auto... bits) noexcept { return (0u | ... | (1u << static_cast<unsigned>(bits))); }

constexpr std::uint32_t kNoError = mask(StatusBit::error_summary, StatusBit::monitor_condition);
constexpr std::uint32_t kSaturation = mask(StatusBit::saturation);
constexpr std::uint32_t kAxiaSaturation = mask(AxiaStatusBit::out_of_range, AxiaStatusBit::gage_out_of_range);
constexpr std::uint32_t kCommunication = mask(StatusBit::network, StatusBit::can, StatusBit::rdt,
                                              StatusBit::ethernet_ip, StatusBit::device_net, StatusBit::http_failure);

std::span<const Entry> table_of(Product product) noexcept {
  return product == Product::axia ? std::span<const Entry>(kAxia) : std::span<const Entry>(kNetBox);
}

std::string name_of(int bit, Product product) {
  const auto table = table_of(product);
  const auto entry = std::find_if(table.begin(), table.end(), [&](const Entry& e) { return e.bit == bit; });
  return entry == table.end() ? "bit " + std::to_string(bit) : entry->name;
}

}  // namespace

StatusVerdict verdict_of(std::uint32_t status, Product product) noexcept {
  if (healthy(status)) return StatusVerdict::sound;
  const std::uint32_t errors = status & ~kNoError;
  const std::uint32_t communication = product == Product::axia ? 0 : kCommunication;
  const std::uint32_t saturation = product == Product::axia ? kAxiaSaturation : kSaturation;
  if (errors == 0 || (errors & ~(communication | saturation)) != 0) return StatusVerdict::faulty;
  return saturated(status, product) ? StatusVerdict::saturated : StatusVerdict::communication;
}

std::vector<std::string> names(std::uint32_t status, Product product) {
  std::vector<std::string> set;
  for (int bit = 30; bit >= 0; --bit) {
    if ((status >> bit & 1u) != 0) set.push_back(name_of(bit, product));
  }
  // The summary alone names no error.
  if (status == 1u << 31) set.push_back("error summary");
  return set;
}

}  // namespace kphi::netbox
