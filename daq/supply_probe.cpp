#include "daq/supply_probe.hpp"

#include <fmt/format.h>

#include "daq/live_supply.hpp"
#include "drivers/device_error.hpp"

namespace kphi::daq {

std::vector<Finding> findings_of(const supply::Identity& identity, const supply::Reading& reading,
                                 const profiles::SupplyPlace& wanted) {
  std::vector<Finding> findings;
  const double volts = wanted.voltage.value(), amps = wanted.current_limit.value();
  if (volts > identity.voltage_max_v || amps > identity.current_max_a) {
    findings.push_back({Severity::fault,
                        fmt::format("it gives {:g} V and {:g} A at most; the bench file wants {:g} V and {:g} A",
                                    identity.voltage_max_v, identity.current_max_a, volts, amps),
                        "lower voltage_v and current_limit_a, or take a larger supply"});
  }
  if (reading.protection != supply::Protection::none) {
    findings.push_back({Severity::warning,
                        fmt::format("its {} protection has tripped", name_of(to_reading(reading).protection)),
                        "find out why; it is forgotten when the output is switched on again"});
  }
  if (reading.output) {
    findings.push_back({Severity::warning,
                        fmt::format("its output is on: {:.4g} V, {:.3g} A", reading.voltage_v, reading.current_a),
                        "switch it off before somebody touches the propeller"});
  }
  return findings;
}

SupplyProbe probe_supply(const profiles::SupplyPlace& place, const Clock& clock) {
  SupplyProbe probe;
  try {
    const auto supply = open_supply(place, clock);
    probe.identity = supply->identity();
    probe.reading = supply->read();
    probe.findings = findings_of(*probe.identity, *probe.reading, place);
  } catch (const DeviceError& error) {
    probe.findings.push_back({Severity::fault, error.what(), ""});
  }
  return probe;
}

std::vector<std::string> SupplyProbe::lines() const {
  std::vector<std::string> lines;
  if (identity) lines.push_back(summary(*identity));
  if (reading) {
    lines.push_back(fmt::format("set {:g} V, limit {:g} A; shows {:.4g} V, {:.3g} A, {:.3g} W, output {}",
                                reading->set_voltage_v, reading->current_limit_a, reading->voltage_v,
                                reading->current_a, reading->power_w(), reading->output ? "on" : "off"));
  }
  for (const Finding& finding : findings) lines.push_back(finding.line());
  return lines;
}

}  // namespace kphi::daq
