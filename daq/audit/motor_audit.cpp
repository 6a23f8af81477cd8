#include "daq/audit/motor_audit.hpp"

#include <algorithm>

namespace kphi::daq {
namespace {

bool answers(const iq::Entry& asked, const iq::Identity& module) {
  const bool newer = module.coil_temperature_client == static_cast<int>(iq::Client::coil_temperature_estimator);
  if (asked.type == iq::Client::temperature_estimator) return !newer;
  return asked.type != iq::Client::coil_temperature_estimator || newer;
}

}  // namespace

iq::AuditRecord read_parameters(const iq::Identity& module, const AskModule& ask) {
  std::vector<iq::Inquiry> asked;
  for (const iq::Entry* entry : iq::kAudited) {
    if (answers(*entry, module)) asked.push_back({entry, std::nullopt});
  }
  const std::vector<iq::Reply> replies = ask(asked);
  iq::AuditRecord record;
  for (std::size_t i = 0; i < asked.size() && i < replies.size(); ++i)
    record.values[iq::audited_index(*asked[i].entry)] = replies[i].value;
  return record;
}

std::optional<Celsius> ask_coil_temperature(const iq::AuditRecord& parameters, const AskModule& ask) {
  const int client = parameters.coil_temperature_client();
  if (client == 0) return std::nullopt;
  const bool newer = client == static_cast<int>(iq::Client::coil_temperature_estimator);
  const auto replies =
      ask({{newer ? &iq::entry<"coil_temperature_estimator.t_coil"> : &iq::entry<"temperature_estimator.temp">,
            std::nullopt}});
  if (replies.empty() || !replies[0].value) return std::nullopt;
  return Celsius(*replies[0].value);
}

iq::Intention motor_intention(const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  iq::Intention intention;
  intention.supply_voltage_max_v = campaign.supply.value();
  for (const RadPerSec level : campaign.profile.levels())
    intention.speed_max_rad_s = std::max(intention.speed_max_rad_s, level.value());
  intention.coil_temperature_max_degc = campaign.limits.coil_temperature_max.value();
  if (config.iq.clock_gain) intention.uid = config.iq.clock_gain->uid;
  return intention;
}

}  // namespace kphi::daq
