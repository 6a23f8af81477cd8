#include "commands/fit_input.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "fit/logs/k_table.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/sha256.hpp"
#include "results/steps_csv.hpp"
#include "results/version.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;

void take_rejected(const results::CampaignFolder& folder, Provenance& provenance) {
  const auto text = [](const nlohmann::json& data, const char* key) {
    return data.contains(key) && data[key].is_string() ? data[key].get<std::string>() : std::string("unknown");
  };
  for (const results::JournalEntry& entry : results::read_journal(folder.journal()).entries)
    if (entry.event == results::kRunAborted)
      provenance.rejected.push_back({text(entry.data, "run"), entry.utc, text(entry.data, "reason")});
}

/// Accepted runs with the checksums the journal holds, and when the last of them ended; without a journal the files
/// as they lie there.
void take_runs(const results::CampaignFolder& folder, Provenance& provenance) {
  if (fs::exists(folder.journal())) {
    for (const results::JournalEntry& entry : results::read_journal(folder.journal()).entries) {
      if (entry.event != results::kRunAccepted || !entry.data.contains("file") || !entry.data.contains("sha256"))
        continue;
      provenance.runs.push_back({entry.data["file"], entry.data["sha256"], "", std::nullopt});
      provenance.measured_utc = entry.utc;
    }
    take_rejected(folder, provenance);
    return;
  }
  for (const fs::path& run : folder.complete_runs())
    provenance.runs.push_back(
        {fs::relative(run, folder.path()).string(), results::sha256_of_file(run), "", std::nullopt});
}

MotorClock clock_of(const fs::path& bench_file) {
  const auto gain = profiles::load_bench(bench_file.string()).iq.clock_gain;
  return gain ? MotorClock{gain->factor, gain->u_factor} : MotorClock{};
}

FitInput campaign_input(const fs::path& path) {
  const auto folder = results::CampaignFolder::open(path);
  if (!fs::exists(folder.steps())) {
    throw ConfigurationError(
        fmt::format("{}: no steps.csv; `kphi replay {}` makes it from the runs", path.string(), path.string()));
  }
  FitInput input;
  input.folder = path;
  input.campaign = true;
  input.steps = results::read_steps(folder.steps());
  input.provenance.source = "steps.csv of the campaign folder";
  take_runs(folder, input.provenance);
  if (fs::exists(folder.bench_file())) input.provenance.clock = clock_of(folder.bench_file());
  if (fs::exists(folder.campaign_file())) {
    const profiles::Campaign campaign = profiles::load_campaign(folder.campaign_file().string());
    input.provenance.campaign = campaign.name;
    input.provenance.propeller_name = campaign.propeller.name;
    input.provenance.supply_v = campaign.supply.value();
  }
  return input;
}

FitInput file_input(const fs::path& path) {
  FitInput input;
  input.folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  input.provenance.campaign = path.stem().string();
  input.provenance.source = path.filename().string();
  const std::string text = results::read_text(path);
  if (is_k_table(text)) {
    input.table = read_k_table(text, path.string());
  } else {
    input.steps = results::parse_steps(text, path.string());
  }
  return input;
}

}  // namespace

FitInput load_input(const std::string& path) {
  const bool campaign = fs::exists(fs::path(path) / "journal.jsonl") || fs::exists(fs::path(path) / "runs");
  if (fs::is_directory(path) && !campaign && !fs::exists(fs::path(path) / "steps.csv")) {
    throw ConfigurationError(path +
                             ": holds no campaign and no steps.csv; name a folder that kphi run or kphi import made");
  }
  FitInput input = campaign                 ? campaign_input(path)
                   : fs::is_directory(path) ? file_input(fs::path(path) / "steps.csv")
                                            : file_input(path);
  input.provenance.tool_version = kVersion;
  return input;
}

}  // namespace kphi::fit
