#include "daq/hardware/supply_probe.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "daq/hardware/live_supply.hpp"

namespace kphi::daq {

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

}  // namespace kphi::daq
