#include "drivers/netbox/wire/status.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace kphi::netbox {
namespace {

using Bit = std::pair<int, const char*>;  // number and name

constexpr Bit kNetBox[] = {
    {1, "HTTP protocol failure"},
    {2, "internal temperature error"},
    {3, "reference voltage or power monitor error"},
    {4, "serial link data unavailable"},
    {5, "analog supply too low"},
    {6, "analog supply too high"},
    {7, "artificial analog ground out of range"},
    {8, "insufficient strain gage excitation current"},
    {9, "excessive strain gage excitation current"},
    {10, "analog board watchdog timeout"},
    {11, "serial flash (SPI) failure"},
    {12, "serial EEPROM (I2C) failure"},
    {13, "stack check error"},
    {14, "watchdog timeout"},
    {16, "monitor condition latched"},
    {17, "transducer saturation or A/D error"},
    {18, "DeviceNet failure"},
    {19, "EtherNet/IP failure"},
    {20, "RDT communication error"},
    {21, "CAN communication error"},
    {22, "network communication failure"},
    {23, "configuration incompatible with calibration"},
    {24, "settings validation error"},
    {25, "halted: configuration errors"},
    {26, "program memory verification error"},
    {27, "serial link communication error"},
    {28, "analog board error"},
    {29, "digital board error"},
    {30, "CPU or RAM error"},
};
/// HTTP, DeviceNet, EtherNet/IP, RDT, CAN, network.
constexpr std::uint32_t kCommunication = 1u << 1 | 1u << 18 | 1u << 19 | 1u << 20 | 1u << 21 | 1u << 22;

constexpr Bit kAxia[] = {
    {0, "temperature error"},
    {1, "supply voltage error"},
    {2, "broken gage"},
    {3, "busy with its memory, filter or calibration"},
    {5, "common error"},
    {7, "calibration not accessible"},
    {16, "monitor condition latched"},
    {27, "gage out of range"},
    {28, "simulated error"},
    {29, "calibration checksum error"},
    {30, "force or torque out of range"},
};

std::string name_of(int bit, Product product) {
  const auto table = product == Product::axia ? std::span<const Bit>(kAxia) : std::span<const Bit>(kNetBox);
  const auto entry = std::ranges::find(table, bit, &Bit::first);
  return entry == table.end() ? "bit " + std::to_string(bit) : entry->second;
}

}  // namespace

StatusVerdict verdict_of(std::uint32_t status, Product product) noexcept {
  if (healthy(status)) return StatusVerdict::sound;
  const std::uint32_t errors = status & ~(kErrorSummary | kMonitorCondition);
  const std::uint32_t communication = product == Product::axia ? 0 : kCommunication;
  if (errors == 0 || (errors & ~(communication | saturation_bits(product))) != 0) return StatusVerdict::faulty;
  return saturated(status, product) ? StatusVerdict::saturated : StatusVerdict::communication;
}

std::vector<std::string> names(std::uint32_t status, Product product) {
  std::vector<std::string> set;
  for (int bit = 30; bit >= 0; --bit) {
    if ((status >> bit & 1u) != 0) set.push_back(name_of(bit, product));
  }
  // The summary alone names no error.
  if (status == kErrorSummary) set.push_back("error summary");
  return set;
}

}  // namespace kphi::netbox
