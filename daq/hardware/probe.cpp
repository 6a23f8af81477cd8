#include "daq/hardware/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "base/error.hpp"
#include "daq/bench/air.hpp"
#include "daq/hardware/live_supply.hpp"
#include "drivers/ambient/source.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::daq {
namespace {

constexpr const char* kSensorRemedy = "check its plug and the four wires to the sensor, or write `ambient: unknown`";

/// An exception becomes a finding.
template <class Work>
UsbProbe probed(std::string device, Work&& work) {
  UsbProbe probe;
  probe.device = std::move(device);
  try {
    probe.words = work();
    probe.answers = true;
  } catch (const DeviceError& error) {
    probe.findings.push_back({Severity::fault, error.what(), ""});
  } catch (const std::invalid_argument& error) {
    probe.findings.push_back({Severity::fault, error.what(), kSensorRemedy});
  }
  return probe;
}

std::string air_of(const std::string& address) {
  const auto sensor = ambient::open(ambient::source_of(address));
  const ambient::Air air = sensor->read();
  return fmt::format("{}: {:.2f} °C, {:.1f} hPa, {:.1f} % humidity: {}", sensor->identity(), air.temperature_c,
                     air.pressure_pa / 100, 100 * air.relative_humidity, words_of(ambient::density_of(air)));
}

UsbProbe probe_instrument(const std::string& address) {
  const std::string uri = "scpi-" + address;
  return probed("SCPI " + uri, [&] { return scpi::open_line(uri)->query("*IDN?"); });
}

/// As it must be written to mean this one.
std::string address_of(const usb::Listing& found, const std::vector<usb::Listing>& all) {
  UsbAddress address{found.vendor, found.product, found.serial, ""};
  const auto like = std::count_if(all.begin(), all.end(), [&](const auto& other) { return fits(address, other); });
  if (like > 1) address.port_path = found.port_path;
  return address.text();
}

bool is_bridge(const usb::Listing& found) { return found.vendor == 0x04d8 && found.product == 0x00dd; }

}  // namespace

std::vector<Finding> findings_of(const supply::Identity& identity, const supply::Reading& reading,
                                 const profiles::SupplyConfig& wanted) {
  std::vector<Finding> findings;
  const double volts = wanted.voltage.value(), amps = wanted.current_limit.value();
  if (volts > identity.voltage_max_v || amps > identity.current_max_a) {
    findings.push_back({Severity::fault,
                        fmt::format("maximum {:g} V and {:g} A; the bench file asks for {:g} V and {:g} A",
                                    identity.voltage_max_v, identity.current_max_a, volts, amps),
                        "lower voltage_v and current_limit_a, or use a larger supply"});
  }
  if (reading.protection != supply::Protection::none) {
    findings.push_back({Severity::warning,
                        fmt::format("{} protection tripped", name_of(to_reading(reading).protection)),
                        "find the cause; switching the output on clears it"});
  }
  if (reading.output) {
    findings.push_back({Severity::warning,
                        fmt::format("output is on: {:.4g} V, {:.3g} A", reading.voltage_v, reading.current_a),
                        "switch it off before anybody touches the propeller"});
  }
  return findings;
}

SupplyProbe probe_supply(const profiles::SupplyConfig& config, const Clock& clock) {
  SupplyProbe probe;
  try {
    const auto supply = open_supply(config, clock);
    probe.identity = supply->identity();
    probe.reading = supply->read();
    probe.findings = findings_of(*probe.identity, *probe.reading, config);
  } catch (const DeviceError& error) {
    probe.findings.push_back({Severity::fault, error.what(), ""});
  }
  return probe;
}

std::vector<std::string> SupplyProbe::lines() const {
  std::vector<std::string> lines;
  if (identity) lines.push_back(summary(*identity));
  if (reading) {
    lines.push_back(fmt::format("set to {:g} V, limit {:g} A; measures {:.4g} V, {:.3g} A, {:.3g} W; output {}",
                                reading->set_voltage_v, reading->current_limit_a, reading->voltage_v,
                                reading->current_a, reading->power_w(), reading->output ? "on" : "off"));
  }
  for (const Finding& finding : findings) lines.push_back(finding.line());
  return lines;
}

std::vector<std::string> UsbProbe::lines() const {
  std::vector<std::string> all;
  if (!words.empty()) all.push_back(words);
  for (const Finding& finding : findings) all.push_back(finding.line());
  return all;
}

UsbProbe probe_sensor(const std::string& address) {
  return probed("ambient " + address, [&] { return air_of(address); });
}

std::vector<UsbProbe> probe_usb(const std::vector<std::string>& known) {
  std::vector<usb::Listing> all;
  try {
    all = usb::Bus().list();
  } catch (const DeviceError&) {
    return {};
  }
  std::vector<UsbProbe> probes;
  for (const usb::Listing& found : all) {
    if (!is_bridge(found) && !found.instrument) continue;
    const std::string address = address_of(found, all);
    const auto is_known = [&](const std::string& name) {
      return name.find(fmt::format("usb:{:04x}:{:04x}", found.vendor, found.product)) != std::string::npos;
    };
    if (std::any_of(known.begin(), known.end(), is_known)) continue;
    probes.push_back(is_bridge(found) ? probe_sensor(address) : probe_instrument(address));
  }
  return probes;
}

}  // namespace kphi::daq
