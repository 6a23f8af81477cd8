#include "daq/hardware/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "base/error.hpp"
#include "base/json.hpp"
#include "daq/bench/air_source.hpp"
#include "daq/hardware/live_supply.hpp"
#include "drivers/ambient/bme280.hpp"
#include "drivers/scpi/scpi_supply.hpp"
#include "drivers/usb/bus.hpp"

namespace kphi::daq {
namespace {

constexpr const char* kSensorRemedy = "check its plug and the four wires to the sensor, or write `ambient: unknown`";

/// An exception becomes a finding.
template <class Ask>
DeviceAnswer answer_of(const std::string& device, Ask&& ask) {
  DeviceAnswer answer{device};
  std::vector<Finding> findings;
  std::string words;
  try {
    words = ask();
    answer.answers = true;
    answer.in_short = words;
  } catch (const DeviceError& error) {
    findings.push_back({Severity::fault, error.what(), ""});
  } catch (const std::invalid_argument& error) {
    findings.push_back({Severity::fault, error.what(), kSensorRemedy});
  }
  answer.details["words"] = words;
  answer.add(findings);
  return answer;
}

std::string air_of(const std::string& address) {
  const auto sensor = ambient::open(ambient::sensor_address(address));
  const ambient::Air air = sensor->read();
  return fmt::format("{}: {:.2f} °C, {:.1f} hPa, {:.1f} % humidity: {}", sensor->identity(), air.temperature_c,
                     air.pressure_pa / 100, 100 * air.relative_humidity, words_of(ambient::density_of(air)));
}

/// As it must be written to mean this one.
std::string address_of(const usb::Listing& found, const std::vector<usb::Listing>& all) {
  UsbAddress address{found.vendor, found.product, found.serial, ""};
  const auto like = std::ranges::count_if(all, [&](const auto& other) { return fits(address, other); });
  if (like > 1) address.port_path = found.port_path;
  return address.text();
}

bool is_bridge(const usb::Listing& found) { return found.vendor == 0x04d8 && found.product == 0x00dd; }

/// Checks a reading against the bench file.
std::vector<Finding> findings_of(const supply::Identity& identity, const SupplyReading& reading,
                                 const profiles::SupplyConfig& wanted) {
  std::vector<Finding> findings;
  const double volts = wanted.voltage.value(), amps = wanted.current_limit.value();
  if (volts > identity.voltage_max_v || amps > identity.current_max_a) {
    findings.push_back({Severity::fault,
                        fmt::format("maximum {:g} V and {:g} A; the bench file asks for {:g} V and {:g} A",
                                    identity.voltage_max_v, identity.current_max_a, volts, amps),
                        "lower voltage_v and current_limit_a, or use a larger supply"});
  }
  if (identity.keypad != SupplyKeypad::free)
    findings.push_back(
        {Severity::note,
         identity.keypad == SupplyKeypad::locked
             ? "its keypad is locked while kphi asks it, so its output key switches nothing"
             : "its maker's firmware locks the keypad while kphi asks it; this one says that it does not",
         "have another switch for the 12 V within reach"});
  if (reading.protection != SupplyProtection::none) {
    findings.push_back({Severity::warning, fmt::format("{} protection tripped", name_of(reading.protection)),
                        "find the cause; switching the output on clears it"});
  }
  if (reading.output) {
    findings.push_back({Severity::warning,
                        fmt::format("output is on: {:.4g} V, {:.3g} A", reading.voltage_v, reading.current_a),
                        "switch it off before anybody touches the propeller"});
  }
  return findings;
}

}  // namespace

void DeviceAnswer::add(const std::vector<Finding>& found) {
  findings.insert(findings.end(), found.begin(), found.end());
  put_worst_first(findings);
  details["findings"] = findings;
}

std::optional<Severity> DeviceAnswer::worst() const {
  if (wanted && !answers) return Severity::fault;
  const auto found = std::ranges::max_element(findings, {}, &Finding::severity);
  return found == findings.end() ? std::nullopt : std::optional(found->severity);
}

DeviceAnswer ask_supply(const profiles::SupplyConfig& config, const Clock& clock) {
  DeviceAnswer answer{"supply " + config.uri};
  std::vector<Finding> findings;
  try {
    const auto supply = open_supply(config, clock);
    const supply::Identity& identity = supply->identity();
    answer.answers = true;
    answer.in_short = summary(identity);
    answer.details = {{"model", identity.model}, {"serial", identity.serial}, {"firmware", identity.firmware}};
    const Instant begun = clock.now();
    const SupplyReading seen = supply->read();
    const double took_s = to_seconds(clock.shrunk(clock.now() - begun));
    answer.in_short +=
        fmt::format(", output {}, {:.4g} V, {:.3g} A", seen.output ? "on" : "off", seen.voltage_v, seen.current_a);
    answer.lines = {
        fmt::format("set to {:g} V, limit {:g} A; measures {:.4g} V, {:.3g} A, {:.3g} W", seen.set_voltage_v,
                    seen.current_limit_a, seen.voltage_v, seen.current_a, seen.power_w()),
        fmt::format("a reading takes {:.2g} s", took_s)};
    answer.details["reading_s"] = took_s;
    KPHI_JSON_MEMBERS(answer.details, seen, voltage_v, current_a, set_voltage_v, current_limit_a);
    answer.details["output"] = seen.output != 0;
    findings = findings_of(identity, seen, config);
  } catch (const DeviceError& error) {
    findings.push_back({Severity::fault, error.what(), ""});
  }
  answer.add(findings);
  return answer;
}

DeviceAnswer ask_sensor(const std::string& address) {
  DeviceAnswer answer = answer_of("ambient " + address, [&] { return air_of(address); });
  if (answer.answers)
    answer.lines.push_back(
        "it must hang in the air that the propeller draws: a warm board beside it adds 3 to 7 °C, 1 to 2 % of k in "
        "standard air; say how far it is to be trusted with ambient: {sensor: …, u_temperature_c: …}");
  return answer;
}

std::vector<DeviceAnswer> ask_usb(const std::vector<DeviceAnswer>& known) {
  std::vector<usb::Listing> all;
  try {
    all = usb::Bus().list();
  } catch (const DeviceError&) {
    return {};
  }
  std::vector<DeviceAnswer> answers;
  for (const usb::Listing& found : all) {
    if (!is_bridge(found) && !found.instrument) continue;
    const std::string name = fmt::format("usb:{:04x}:{:04x}", found.vendor, found.product);
    if (std::ranges::any_of(known, [&](const auto& each) { return each.device.find(name) != each.device.npos; }))
      continue;
    const std::string address = address_of(found, all);
    const auto ask = [&] { return scpi::open_line("scpi-" + address)->query("*IDN?"); };
    answers.push_back(is_bridge(found) ? ask_sensor(address) : answer_of("SCPI scpi-" + address, ask));
    answers.back().wanted = false;
  }
  return answers;
}

}  // namespace kphi::daq
