#include "results/campaign_state.hpp"

#include <algorithm>
#include <system_error>

#include "base/error.hpp"
#include "results/sha256.hpp"

namespace kphi::results {
namespace {

constexpr std::string_view kPart = ".h5.part";
constexpr std::string_view kRun = ".h5";

std::string set_aside(const CampaignFolder& folder, const std::filesystem::path& file, std::string_view ending,
                      const std::string& becomes, FileLayer& files) {
  std::string stem = file.string();
  stem.resize(stem.size() - ending.size());
  try {
    const std::filesystem::path to = free_name(stem + becomes, std::string(ending));
    files.rename(file, to);
    files.sync_folder(folder.runs());
    return "runs/" + to.filename().string();
  } catch (const std::system_error& error) {
    throw RecordError(failure_text(file.string(), error.code().value()));
  }
}

}  // namespace

CampaignState state_of(const JournalReading& journal) {
  CampaignState state;
  for (const JournalEntry& entry : journal.entries) {
    if (entry.event == kCampaignStarted || entry.event == kCampaignResumed) state.identity = entry.data;
    if (entry.event == kCampaignResumed) state.safety_stop.clear();
    if (entry.data.value("safety_stop", false)) state.safety_stop = entry.data.value("reason", "unknown cause");
    state.finished = entry.event == kCampaignFinished;
    if (entry.event != kRunAccepted) continue;
    const auto file = entry.data.find("file");
    const auto digest = entry.data.find("sha256");
    if (file == entry.data.end() || digest == entry.data.end()) continue;
    state.accepted.push_back({*file, *digest, entry.time_ns});
  }
  return state;
}

std::vector<std::string> changed_runs(const CampaignFolder& folder, const CampaignState& state) {
  std::vector<std::string> problems;
  for (const AcceptedRun& run : state.accepted) {
    const std::filesystem::path path = folder.path() / run.file;
    if (!std::filesystem::exists(path)) {
      problems.push_back(path.string() + ": is missing, the journal names it");
    } else if (sha256_of_file(path) != run.sha256) {
      problems.push_back(path.string() + ": is not the file whose SHA-256 the journal holds");
    }
  }
  return problems;
}

std::vector<std::string> set_leftovers_aside(const CampaignFolder& folder, const CampaignState& state,
                                             FileLayer& files) {
  std::vector<std::string> names;
  for (const auto& file : folder.complete_runs()) {
    const std::string name = "runs/" + file.filename().string();
    const bool accepted = std::any_of(state.accepted.begin(), state.accepted.end(),
                                      [&](const AcceptedRun& run) { return run.file == name; });
    if (!accepted) names.push_back(set_aside(folder, file, kRun, ".unaccepted", files));
  }
  for (const auto& file : folder.other_runs()) {
    const std::string name = file.filename().string();
    if (!name.ends_with(kPart) || name.find(".interrupted") != std::string::npos) continue;
    names.push_back(set_aside(folder, file, kPart, ".interrupted", files));
  }
  return names;
}

}  // namespace kphi::results
