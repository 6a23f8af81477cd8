// How far a campaign has come, by its journal alone: only what the journal holds was accepted.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "results/campaign_folder.hpp"
#include "results/journal.hpp"

namespace kphi::results {

struct AcceptedRun {
  std::string file;  ///< relative to the campaign's folder
  std::string sha256;
  Nanoseconds time_ns = 0;  ///< bench time of its acceptance
};

struct CampaignState {
  /// Tool, files and devices of the campaign: data of campaign_started, or of the last campaign_resumed. Null: it was
  /// never begun.
  nlohmann::json identity;
  std::vector<AcceptedRun> accepted;  ///< in the order of their acceptance
  bool finished = false;              ///< campaign_finished is the last word
  std::string safety_stop;            ///< what stopped it, if that was a safety stop and nobody has resumed it since
};

[[nodiscard]] CampaignState state_of(const JournalReading& journal);

/// Reads every accepted run and compares. One line for each that is missing or not the file that was accepted.
[[nodiscard]] std::vector<std::string> changed_runs(const CampaignFolder& folder, const CampaignState& state);

/// Gives what a killed program left in runs/ without being accepted a name that says so, never one that is taken:
/// `.h5.part` becomes `.interrupted.h5.part`, a complete file that the journal does not hold `.unaccepted.h5`. Returns
/// the new names, relative to the folder. Throws RecordError.
std::vector<std::string> set_leftovers_aside(const CampaignFolder& folder, const CampaignState& state,
                                             FileLayer& files = disk());

}  // namespace kphi::results
