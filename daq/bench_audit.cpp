#include "daq/bench_audit.hpp"

#include "daq/load_cell_audit.hpp"
#include "daq/motor_audit.hpp"
#include "profiles/configuration_error.hpp"

namespace kphi::daq {
namespace {

std::string remedied(const Finding& finding) {
  return finding.next_move.empty() ? finding.what : finding.what + "; " + finding.next_move;
}

void refuse_faults(const std::vector<BenchFinding>& found, const profiles::Bench& place) {
  std::string faults;
  for (const auto& [device, finding] : found) {
    if (finding.severity != Severity::fault) continue;
    const std::string where = device == "motor" ? "IQ module " + place.iq.device : "Net Box " + place.netbox.host;
    faults += (faults.empty() ? "" : "\n  ") + where + ": " + remedied(finding);
  }
  if (!faults.empty()) throw ConfigurationError(faults);
}

}  // namespace

std::vector<BenchFinding> audit_bench(Bench& bench, const profiles::Campaign& campaign, const profiles::Bench& place) {
  std::vector<BenchFinding> found;
  for (Finding& finding : audit_load_cell(bench.load_cell(), campaign, place))
    found.push_back({"load cell", std::move(finding)});
  for (Finding& finding : iq::audit(bench.motor().parameters(), motor_intention(campaign, place)))
    found.push_back({"motor", std::move(finding)});
  refuse_faults(found, place);
  return found;
}

}  // namespace kphi::daq
