// What a campaign folder holds, in a few lines: for `kphi info` and `kphi list`.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "commands/commands.hpp"
#include "results/campaign_folder.hpp"
#include "results/steps_csv.hpp"

namespace kphi::commands {

struct CampaignSummary {
  std::string folder;
  std::string started_utc;  ///< of the journal's first entry; empty: no journal
  std::string campaign, propeller, operator_name;
  std::string origin = "unknown";     ///< or measured, simulated
  std::size_t runs = 0, planned = 0;  ///< accepted; 0 planned: unknown
  results::FlaggedSteps steps{};      ///< of steps.csv
  std::size_t not_needed = 0;         ///< steps that runs left out because k was certain enough
  bool finished = false;
  std::string safety_stop;                 ///< its reason; empty: none, or resumed since
  std::optional<double> K_T, expanded_95;  ///< N/(rad/s)²; nullopt: not fitted
  std::string verdict;                     ///< in words; empty: not fitted, or an older file
  std::string damage;                      ///< what of the folder could not be read; empty: nothing

  /// "15 of 15"
  [[nodiscard]] std::string progress() const;
  /// "1.5419e-06 ± 1.2e-09", "not fitted"
  [[nodiscard]] std::string coefficient() const;
  /// The command that comes next; empty: none.
  [[nodiscard]] std::string next() const;
};

/// Reads journal, campaign.yaml, steps.csv and coefficients.yaml; no run. Never throws for what they hold.
[[nodiscard]] CampaignSummary summary_of(const results::CampaignFolder& folder);
[[nodiscard]] Json to_json(const CampaignSummary& summary);
/// One fact a line.
[[nodiscard]] std::string to_text(const CampaignSummary& summary);

}  // namespace kphi::commands
