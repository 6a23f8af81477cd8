#include "daq/audit/load_cell_audit.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/error.hpp"
#include "results/reduction/settling.hpp"

namespace kphi::daq {
namespace {

using netbox::Finding;
using netbox::Severity;

}  // namespace

netbox::Intention intention_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  netbox::Intention intention;
  for (const RadPerSec level : campaign.profile.levels()) intention.speeds_rpm.push_back(to_rpm(level));
  intention.blades = campaign.propeller.blades;
  intention.largest_thrust_n = campaign.limits.thrust_max.value();
  intention.thrust_axis = config.thrust_axis;
  intention.rate_hz = config.netbox.rate_hz;
  intention.records_per_datagram = config.netbox.records_per_datagram;
  // A line with less than one period in the shortest averaging window (settling.hpp) would bias the mean.
  const double left_s = (campaign.profile.dwell - campaign.minimum_discard).value();
  if (left_s > 0)
    intention.alias_limit_hz = std::max(intention.alias_limit_hz, 1 / std::min(results::kLeastWindow, left_s / 2));
  return intention;
}

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

std::vector<Finding> audit_load_cell(const LoadCellLink& cell, const profiles::Campaign& campaign,
                                     const profiles::BenchConfig& config) {
  const netbox::Configuration& box = cell.configuration();
  std::vector<Finding> findings = netbox::audit(box, intention_of(campaign, config));
  for (auto& more : {unset(box, config.netbox.settings), cell.findings()})
    findings.insert(findings.end(), more.begin(), more.end());
  put_worst_first(findings);
  return findings;
}

void refuse_unsuitable(const LoadCellLink& cell, const profiles::Campaign& campaign,
                       const profiles::BenchConfig& config) {
  std::string faults;
  for (const Finding& found : audit_load_cell(cell, campaign, config)) {
    if (found.severity != Severity::fault) continue;
    faults += fmt::format("{}Net Box {}: {}; {}", faults.empty() ? "" : "\n  ", config.netbox.host, found.what,
                          found.next_move);
  }
  if (!faults.empty()) throw ConfigurationError(faults);
}

}  // namespace kphi::daq
