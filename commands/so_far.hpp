// What a campaign that is being run knows so far, in one line.
#pragma once

#include <string>
#include <vector>

#include "daq/campaign/campaign_run.hpp"
#include "profiles/campaign.hpp"

namespace kphi::commands {

/// For run_campaign(). `wishes` as of `kphi plan --want`; throws ConfigurationError for one that it does not
/// understand. Errors that no repetition shows are not in it. The campaign must outlive the function.
[[nodiscard]] daq::SoFar so_far(const profiles::Campaign& campaign, const std::vector<std::string>& wishes);

}  // namespace kphi::commands
