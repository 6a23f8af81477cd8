#include "daq/audit/bench_audit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "results/reduction/bin_statistics.hpp"

namespace kphi::daq {
namespace {

/// Settings of the bench file that the box does not have, except rate and buffer, which netbox::audit checks.
std::vector<Finding> unset(const netbox::Configuration& box, const profiles::NetBoxSettings& wanted) {
  std::vector<Finding> findings;
  const int cutoff = static_cast<int>(netbox::filter_cutoff_hz(box.filter_code).value_or(-1));
  if (wanted.filter_hz && *wanted.filter_hz != cutoff) {
    findings.push_back(
        {Severity::fault,
         fmt::format("the box filters at {} Hz, netbox.settings.filter_hz is {}", cutoff, *wanted.filter_hz),
         "set the filter on the box's Settings page, or remove filter_hz"});
  }
  if (wanted.configuration && *wanted.configuration != box.slot) {
    findings.push_back({Severity::fault,
                        fmt::format("configuration {} is active in the box, netbox.settings.configuration is {}",
                                    box.slot, *wanted.configuration),
                        fmt::format("choose it on the box's Settings page, where it is number {}, or remove "
                                    "configuration",
                                    *wanted.configuration + 1)});
  }
  return findings;
}

/// An unknown clock gain has a line of its own in journal and report.
iq::Intention motor_intention(const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  iq::Intention intention;
  intention.supply_voltage_max_v = campaign.supply.value();
  for (const RadPerSec level : campaign.profile.levels())
    intention.speed_max_rad_s = std::max(intention.speed_max_rad_s, level.value());
  intention.coil_temperature_max_degc = limit_of_files(Watched::coil_temperature, campaign, config);
  if (config.iq.clock_gain) intention.uid = config.iq.clock_gain->uid;
  intention.accepted_without = config.iq.accept_without;
  return intention;
}

std::vector<BenchFinding> audit_load_cell(const LoadCellLink& cell, const profiles::Campaign& campaign,
                                          const profiles::BenchConfig& config) {
  std::vector<Finding> findings = cell.findings();
  const auto add = [&](const std::vector<Finding>& more) { findings.insert(findings.end(), more.begin(), more.end()); };
  if (const netbox::Configuration* box = cell.box()) {
    add(netbox::audit(*box, intention_of(campaign, config)));
    add(unset(*box, config.netbox.settings));
  } else if (campaign.box_bias) {
    add({{Severity::fault, "box_bias of the campaign needs a Net Box", "leave it out: kphi subtracts its own zeros"}});
  }
  put_worst_first(findings);
  std::vector<BenchFinding> found;
  for (Finding& finding : findings) found.push_back({Source::load_cell, std::move(finding)});
  return found;
}

void refuse_faults(const std::vector<BenchFinding>& found, const profiles::BenchConfig& config) {
  std::string faults;
  for (const auto& [device, finding] : found) {
    if (finding.severity != Severity::fault) continue;
    const std::string where =
        device == Source::motor ? profiles::motor_words(config) : profiles::load_cell_words(config);
    faults += (faults.empty() ? "" : "\n  ") + where + ": " + finding.words();
  }
  if (!faults.empty()) throw ConfigurationError(faults);
}

}  // namespace

std::vector<BenchFinding> audit_bench(Bench& bench, const profiles::Campaign& campaign,
                                      const profiles::BenchConfig& config) {
  std::vector<BenchFinding> found = audit_load_cell(bench.load_cell(), campaign, config);
  const iq::AuditRecord& module = bench.motor().parameters();
  for (Finding& finding : bench.motor().findings()) found.push_back({Source::motor, std::move(finding)});
  if (!module.values.empty())
    for (Finding& finding : iq::audit(module, motor_intention(campaign, config)))
      found.push_back({Source::motor, std::move(finding)});
  refuse_faults(found, config);
  return found;
}

void require_suitable(const LoadCellLink& cell, const profiles::Campaign& campaign,
                      const profiles::BenchConfig& config) {
  refuse_faults(audit_load_cell(cell, campaign, config), config);
}

netbox::Intention intention_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  netbox::Intention intention;
  for (const RadPerSec level : campaign.profile.levels()) intention.speeds_rpm.push_back(to_rpm(level));
  intention.blades = campaign.propeller.blades;
  intention.largest_thrust_n = limit_of_files(Watched::thrust, campaign, config);
  intention.thrust_axis = config.thrust_axis;
  intention.rate_hz = config.netbox.rate_hz;
  intention.records_per_datagram = config.netbox.records_per_datagram;
  // A line with less than one period in the shortest averaging window (bin_statistics.hpp) would bias the mean.
  const double left_s = (shortest_dwell(campaign.profile) - campaign.minimum_discard).value();
  if (left_s > 0)
    intention.alias_limit_hz = std::max(intention.alias_limit_hz, 1 / std::min(results::kLeastWindow, left_s / 2));
  return intention;
}

std::optional<Celsius> ask_coil_temperature(const iq::AuditRecord& parameters, const iq::Ask& ask) {
  const int client = parameters.coil_temperature_client();
  if (client == 0) return std::nullopt;
  const bool newer = client == static_cast<int>(iq::Client::coil_temperature_estimator);
  const auto replies =
      ask({{newer ? &iq::entry<"coil_temperature_estimator.t_coil"> : &iq::entry<"temperature_estimator.temp">,
            std::nullopt}});
  if (replies.empty() || !replies[0].value) return std::nullopt;
  return Celsius(*replies[0].value);
}

}  // namespace kphi::daq
