// The motor module's parameters against the campaign, before anything turns.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "daq/bench/bench.hpp"
#include "drivers/iq/service/audit.hpp"
#include "drivers/iq/session/inquiries.hpp"
#include "drivers/iq/wire/identity.hpp"
#include "profiles/campaign.hpp"

namespace kphi::daq {

/// Asks a connected module, between its polls. Throws DeviceError.
using AskModule = std::function<std::vector<iq::Reply>(std::vector<iq::Inquiry>)>;

/// All audited parameters in one inquiry, without the coil temperature client that the module lacks.
[[nodiscard]] iq::AuditRecord read_parameters(const iq::Identity& module, const AskModule& ask);

/// From the client that `parameters` shows; nullopt without one or without an answer.
[[nodiscard]] std::optional<Celsius> ask_coil_temperature(const iq::AuditRecord& parameters, const AskModule& ask);

/// Top speed, limits and supply of the campaign; the clock gain's module of the bench file. An unknown gain has a line
/// of its own in journal and report.
[[nodiscard]] iq::Intention motor_intention(const profiles::Campaign& campaign, const profiles::BenchConfig& config);

}  // namespace kphi::daq
