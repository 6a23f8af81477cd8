// Whether a campaign folder still holds what its journal says.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "results/campaign_folder.hpp"

namespace kphi::results {

struct CampaignVerification {
  std::size_t entries = 0;            ///< of the journal
  std::size_t runs = 0;               ///< complete runs looked at
  bool torn_last_line = false;        ///< of the journal; no problem
  std::vector<std::string> problems;  ///< one line each, with the file's name
  std::vector<std::string> remarks;   ///< likewise: what is whole, but not as kphi left it
  [[nodiscard]] bool whole() const { return problems.empty(); }
};

/// The journal's checksums; every run by itself and by its SHA-256 in the journal; runs that one knows and the other
/// not.
[[nodiscard]] CampaignVerification verify_campaign(const CampaignFolder& folder);

}  // namespace kphi::results
