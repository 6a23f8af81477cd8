#include "results/campaign_verification.hpp"

#include <map>
#include <system_error>

#include "base/error.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/sha256.hpp"

namespace kphi::results {
namespace {

/// File (relative to the folder) → SHA-256, as last written down.
std::map<std::string, std::string> recorded_digests(const CampaignFolder& folder, CampaignVerification& found) {
  std::map<std::string, std::string> digests;
  if (!std::filesystem::exists(folder.journal())) {
    found.problems.push_back(folder.journal().string() + ": is missing");
    return digests;
  }
  const JournalReading journal = read_journal(folder.journal());
  found.entries = journal.entries.size();
  found.torn_last_line = journal.torn_last_line;
  found.problems.insert(found.problems.end(), journal.problems.begin(), journal.problems.end());
  for (const JournalEntry& entry : journal.entries) {
    const auto& data = entry.data;
    if (!data.is_object() || !data.contains("file") || !data.contains("sha256")) continue;
    if (data["file"].is_string() && data["sha256"].is_string()) digests[data["file"]] = data["sha256"];
  }
  return digests;
}

void check_digest(const CampaignFolder& folder, const std::string& file, const std::string& digest,
                  CampaignVerification& found) {
  const std::filesystem::path path = folder.path() / file;
  if (!std::filesystem::exists(path)) {
    found.problems.push_back(path.string() + ": is missing, the journal names it");
  } else if (sha256_of_file(path) != digest) {
    found.problems.push_back(path.string() + ": is not the file whose SHA-256 the journal holds");
  }
}

/// A copy, or a version control system, may have lost it; the SHA-256 tells whether anybody made use of it.
bool is_writable(const std::filesystem::path& path) {
  using std::filesystem::perms;
  std::error_code none;
  const perms all = std::filesystem::status(path, none).permissions();
  return (all & (perms::owner_write | perms::group_write | perms::others_write)) != perms::none;
}

}  // namespace

CampaignVerification verify_campaign(const CampaignFolder& folder) {
  CampaignVerification found;
  const auto digests = recorded_digests(folder, found);
  for (const auto& [file, digest] : digests) check_digest(folder, file, digest, found);
  std::vector<std::filesystem::path> runs = folder.complete_runs();
  for (const auto& path : folder.reference_runs()) runs.push_back(path);
  for (const auto& path : runs) {
    ++found.runs;
    if (is_writable(path)) found.remarks.push_back(path.string() + ": is writable; chmod a-w it");
    for (const std::string& problem : verify_run(path).problems) {
      found.problems.push_back(problem.find(path.string()) == std::string::npos ? path.string() + ": " + problem
                                                                                : problem);
    }
    if (!digests.contains("runs/" + path.filename().string())) {
      found.problems.push_back(path.string() + ": the journal holds no SHA-256 of it");
    }
  }
  return found;
}

}  // namespace kphi::results
