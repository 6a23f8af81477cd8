// Resuming a campaign that was stopped or killed: which runs are accepted, and whether files, program and devices are
// unchanged.
#pragma once

#include <string>
#include <vector>

#include "daq/bench/bench.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"

namespace kphi::daq {

struct Resumption {
  results::CampaignState state;
  std::string cleared_by;       ///< name of the operator who cleared the safety stop; empty: not cleared
  bool accept_changes = false;  ///< resume in spite of changes
};

/// Program and files, and, once `bench` is connected, devices, as the journal's first line records them.
[[nodiscard]] nlohmann::json identity_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config);
void add_devices(nlohmann::json& identity, Bench& bench);

/// Which entries of `now` differ from `began`, one phrase each; entries missing in `now` are not compared.
[[nodiscard]] std::vector<std::string> changes_since(const nlohmann::json& began, const nlohmann::json& now);

/// Throws ConfigurationError with the changes and the next move, or returns them if they are accepted.
std::vector<std::string> require_unchanged(const results::CampaignFolder& folder, const Resumption& resumption,
                                           const nlohmann::json& now);

/// Reads the journal and every accepted run. Throws DataRejected if a run changed since it was accepted or the journal
/// cannot be trusted.
[[nodiscard]] Resumption inspect(const results::CampaignFolder& folder, bool accept_changes);

/// Writes the present campaign or bench file; a different former copy is kept as `campaign.replaced.yaml`,
/// `campaign.replaced-2.yaml` …
void keep_copy(const std::filesystem::path& copy, const std::string& text, results::FileLayer& files);

}  // namespace kphi::daq
