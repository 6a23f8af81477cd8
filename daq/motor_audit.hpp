// The motor module's parameters against the campaign, before anything turns.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "daq/bench.hpp"
#include "drivers/iq/audit.hpp"
#include "drivers/iq/identity.hpp"
#include "drivers/iq/inquiries.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// Asks a connected module, between its polls. Throws DeviceError.
using AskModule = std::function<std::vector<iq::Reply>(std::vector<iq::Inquiry>)>;

/// All that is audited, in one inquiry; not of the coil temperature client that the module does not have.
[[nodiscard]] iq::AuditRecord read_parameters(const iq::Identity& module, const AskModule& ask);

/// Of the client that `parameters` shows; nothing when there is none, or no answer came.
[[nodiscard]] std::optional<Celsius> ask_coil_temperature(const iq::AuditRecord& parameters, const AskModule& ask);

/// Top speed, limits and supply of the campaign; the clock gain's module of the bench file. That no gain is known has
/// a line of its own in journal and report.
[[nodiscard]] iq::Intention motor_intention(const profiles::Campaign& campaign, const profiles::Bench& place);

}  // namespace kphi::daq
