// Going on with a campaign that was stopped or killed: what is accepted, and whether files, program and devices are
// still those that it was begun with.
#pragma once

#include <string>
#include <vector>

#include "daq/bench.hpp"
#include "profiles/bench.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"
#include "results/campaign_state.hpp"

namespace kphi::daq {

struct Resumption {
  results::CampaignState state;
  std::string cleared_by;       ///< name of the operator who cleared the safety stop; empty: not cleared
  bool accept_changes = false;  ///< the person wants to go on although something is not what it was
};

/// What a campaign's journal says at its beginning of program and files, and, once `bench` is connected, of the
/// devices.
[[nodiscard]] nlohmann::json identity_of(const profiles::Campaign& campaign, const profiles::Bench& place);
void add_devices(nlohmann::json& identity, Bench& bench);

/// What of `now` is not as it was in `began`; what `now` does not speak of is not asked. One phrase each.
[[nodiscard]] std::vector<std::string> changes_since(const nlohmann::json& began, const nlohmann::json& now);

/// Throws ConfigurationError that names the changes and the next move; returns them when they are accepted.
std::vector<std::string> require_unchanged(const results::CampaignFolder& folder, const Resumption& resumption,
                                           const nlohmann::json& now);

/// Reads the journal and every accepted run. Throws DataRejected when one of them is not what was accepted, RecordError
/// when the journal cannot be trusted.
[[nodiscard]] Resumption look_at(const results::CampaignFolder& folder, bool accept_changes);

/// The campaign or bench file as it is now, beside the former one, which is kept as `campaign.replaced.yaml`,
/// `campaign.replaced-2.yaml` …; nothing when they are the same.
void keep_copy(const std::filesystem::path& copy, const std::string& text, results::FileLayer& files);

}  // namespace kphi::daq
