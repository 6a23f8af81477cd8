#include "daq/hardware/usb_probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "base/error.hpp"
#include "daq/bench/air.hpp"
#include "drivers/ambient/source.hpp"
#include "drivers/scpi/open.hpp"
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
