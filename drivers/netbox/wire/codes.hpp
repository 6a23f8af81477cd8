// The Net Box's numbers: products, commands, status bits, unit codes. Manual: ATI 9620-05-NET FT.
#pragma once

#include <cstdint>

namespace kphi::netbox {

/// RDT commands (Table 10.1). None is acknowledged; the newest wins, whoever sent it.
enum class Command : std::uint16_t {
  stop = 0,
  axia_single_block = 1,  ///< Ethernet Axia: one record per datagram
  real_time = 2,          ///< one record per datagram
  axia_multi_block = 2,   ///< Ethernet Axia: "RDT Buffer Size" records per datagram
  buffered = 3,           ///< "RDT Buffer Size" records per datagram
  multi_unit = 4,
  reset_latch = 0x41,
  set_bias = 0x42,
};

/// Bits of the status word (Table 17.1, Net Box).
enum class StatusBit : std::uint8_t {
  http_failure = 1,
  temperature = 2,
  reference_voltage = 3,
  serial_link_unavailable = 4,
  analog_supply_low = 5,
  analog_supply_high = 6,
  analog_ground = 7,
  excitation_low = 8,
  excitation_high = 9,
  analog_watchdog = 10,
  serial_flash = 11,
  serial_eeprom = 12,
  stack_check = 13,
  watchdog = 14,
  monitor_condition = 16,  ///< latched; no error
  saturation = 17,
  device_net = 18,
  ethernet_ip = 19,
  rdt = 20,
  can = 21,
  network = 22,
  calibration_mismatch = 23,
  settings_validation = 24,
  halted = 25,
  program_memory = 26,
  serial_link = 27,
  analog_board = 28,
  digital_board = 29,
  cpu_or_ram = 30,
  error_summary = 31,  ///< also set together with monitor_condition
};

/// Bits of the status word of an Ethernet Axia.
enum class AxiaStatusBit : std::uint8_t {
  temperature = 0,
  supply_voltage = 1,
  broken_gage = 2,
  busy = 3,  ///< commits to its memory, or changes filter or calibration
  common_error = 5,
  calibration_not_accessible = 7,
  monitor_condition = 16,  ///< latched; no error
  gage_out_of_range = 27,  ///< stays for 32 samples
  simulated_error = 28,
  calibration_checksum = 29,
  out_of_range = 30,  ///< force or torque; saturated; stays for 32 samples
  error_summary = 31,
};

/// `cfgfu`, and forceUnits of the TCP interface.
enum class ForceUnit : std::uint8_t { lbf = 1, newton = 2, klbf = 3, kilonewton = 4, kgf = 5, gf = 6 };

/// `cfgtu`, and torqueUnits of the TCP interface.
enum class TorqueUnit : std::uint8_t {
  lbf_inch = 1,
  lbf_foot = 2,
  newton_metre = 3,
  newton_millimetre = 4,
  kgf_centimetre = 5,
  kilonewton_metre = 6,
};

/// The boxes that speak RDT differ in commands, status word and rates.
enum class Product : std::uint8_t {
  net_box,
  axia,  ///< Ethernet Axia (9610-05-Ethernet Axia), Schunk FTN-Axia
};

[[nodiscard]] constexpr const char* name_of(Product product) noexcept {
  return product == Product::axia ? "Axia" : "Net Box";
}

}  // namespace kphi::netbox
