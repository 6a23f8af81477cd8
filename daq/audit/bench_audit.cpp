#include "daq/audit/bench_audit.hpp"

#include "base/error.hpp"
#include "daq/audit/load_cell_audit.hpp"
#include "daq/audit/motor_audit.hpp"

namespace kphi::daq {
namespace {

std::string remedied(const Finding& finding) {
  return finding.next_move.empty() ? finding.what : finding.what + "; " + finding.next_move;
}

void refuse_faults(const std::vector<BenchFinding>& found, const profiles::BenchConfig& config) {
  std::string faults;
  for (const auto& [device, finding] : found) {
    if (finding.severity != Severity::fault) continue;
    const std::string where =
        device == Source::motor ? "IQ module " + config.iq.device : "Net Box " + config.netbox.host;
    faults += (faults.empty() ? "" : "\n  ") + where + ": " + remedied(finding);
  }
  if (!faults.empty()) throw ConfigurationError(faults);
}

}  // namespace

std::vector<BenchFinding> audit_bench(Bench& bench, const profiles::Campaign& campaign,
                                      const profiles::BenchConfig& config) {
  std::vector<BenchFinding> found;
  for (Finding& finding : audit_load_cell(bench.load_cell(), campaign, config))
    found.push_back({Source::load_cell, std::move(finding)});
  for (Finding& finding : iq::audit(bench.motor().parameters(), motor_intention(campaign, config)))
    found.push_back({Source::motor, std::move(finding)});
  refuse_faults(found, config);
  return found;
}

}  // namespace kphi::daq
