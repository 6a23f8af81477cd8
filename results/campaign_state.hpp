// Progress of a campaign by its journal, which alone says what was accepted, and whether its folder still matches it.
#pragma once

#include <cstddef>
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
  /// Tool, files and devices of the campaign: data of campaign_started, or of the last campaign_resumed. Null: not
  /// started.
  nlohmann::json identity;
  std::vector<AcceptedRun> accepted;  ///< in the order of their acceptance
  bool finished = false;              ///< campaign_finished is the last event
  std::string safety_stop;            ///< reason of the last safety stop; empty: none, or resumed since
};

[[nodiscard]] CampaignState state_of(const JournalReading& journal);

/// Compares the SHA-256 of every accepted run; one line for each that is missing or changed.
[[nodiscard]] std::vector<std::string> changed_runs(const CampaignFolder& folder, const CampaignState& state);

/// Renames the unaccepted files of a killed program in runs/, never over another file: `.h5.part` to
/// `.interrupted.h5.part`, a complete file that is not in the journal to `.unaccepted.h5`. Returns the new names,
/// relative to the folder. Throws RecordError.
std::vector<std::string> set_leftovers_aside(const CampaignFolder& folder, const CampaignState& state,
                                             FileLayer& files = disk());

struct CampaignVerification {
  std::size_t entries = 0;            ///< of the journal
  std::size_t runs = 0;               ///< complete runs looked at
  bool torn_last_line = false;        ///< of the journal; not a problem
  std::vector<std::string> problems;  ///< one line each, with the file's name
  std::vector<std::string> remarks;   ///< likewise: undamaged, but not as kphi left it
  [[nodiscard]] bool whole() const { return problems.empty(); }
};

/// Checks the journal's checksums, every run by itself and by its SHA-256 in the journal, and runs missing in either.
[[nodiscard]] CampaignVerification verify_campaign(const CampaignFolder& folder);

}  // namespace kphi::results
