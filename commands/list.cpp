// `kphi list`: the campaigns and imported logs in a folder, a line each.
#include <algorithm>
#include <filesystem>
#include <optional>

#include "base/text.hpp"
#include "commands/campaign_summary.hpp"
#include "commands/inputs.hpp"
#include "results/file_layer.hpp"

namespace kphi::commands {
namespace {

namespace fs = std::filesystem;

struct ListRequest {
  std::string folder = "results";
  bool json = false;
};

/// nullopt: no campaign's folder.
std::optional<CampaignSummary> campaign_in(const fs::path& folder) {
  try {
    return summary_of(results::CampaignFolder::open(folder));
  } catch (const DataRejected& error) {
    CampaignSummary summary;
    summary.folder = folder.string();
    summary.damage = error.what();
    return summary;
  } catch (const RecordError&) {
    return std::nullopt;
  }
}

/// What `kphi import` wrote; nullopt: no such folder.
std::optional<CampaignSummary> log_in(const fs::path& folder) {
  if (!fs::is_regular_file(folder / "import.json")) return std::nullopt;
  CampaignSummary summary;
  summary.folder = folder.string();
  const Json record = Json::parse(results::read_text(folder / "import.json"), nullptr, false);
  if (!record.is_object() || record.value("format", "") != "kphi-import/1") {
    summary.damage = "import.json is not one of kphi";
    return summary;
  }
  const auto number = [&](const char* key) {
    return record.contains(key) && record[key].is_number() ? std::optional(record[key].get<double>()) : std::nullopt;
  };
  summary.propeller = record.value("propeller", std::string());
  summary.steps.steps = static_cast<int>(number("rows_used").value_or(0));
  summary.verdict = record.value("k_means_nothing", false) ? "log, no k" : "log";
  summary.K_T = number("k_n_s2_per_rad2");  // its ± is known to kphi fit, with what nobody measured in it
  summary.finished = true;
  return summary;
}

std::vector<CampaignSummary> campaigns_in(const std::string& folder) {
  std::vector<CampaignSummary> found;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (std::error_code none; entry.is_directory(none))
      if (auto one = campaign_in(entry.path()); one || (one = log_in(entry.path()))) found.push_back(std::move(*one));
  std::ranges::sort(found, {}, [](const CampaignSummary& one) { return std::pair(one.started_utc, one.folder); });
  return found;
}

/// "2021-05-30 08:00" of 2021-05-30T08:00:00Z.
std::string minute_of(std::string utc) {
  if (utc.size() < 16) return "unknown";
  utc[10] = ' ';
  return utc.substr(0, 16);
}

void print_table(const std::vector<CampaignSummary>& campaigns) {
  fmt::print("{:<16}  {:<9} {:<9} {:<9} {:<24} {:<14} {}\n", "date (UTC)", "origin", "propeller", "runs",
             "K_T in N/(rad/s)^2", "verdict", "folder");
  for (const CampaignSummary& one : campaigns) {
    const std::string verdict = !one.damage.empty()        ? "damaged"
                                : !one.safety_stop.empty() ? "safety stop"
                                                           : one.verdict;
    fmt::print("{:<16}  {:<9} {:<9} {:<9} {:<24} {:<14} {}\n", minute_of(one.started_utc), one.origin,
               printable(one.propeller), one.progress(), one.coefficient(), verdict,
               fs::path(one.folder).filename().string());
  }
}

ExitCode list(const ListRequest& request) {
  if (!fs::is_directory(request.folder))
    throw ConfigurationError(request.folder + ": no such folder; name the one that holds the campaigns: kphi list DIR");
  const std::vector<CampaignSummary> campaigns = campaigns_in(request.folder);
  if (request.json) {
    Json all = Json::array();
    for (const CampaignSummary& one : campaigns) all.push_back(to_json(one));
    print_json(all);
  } else if (campaigns.empty()) {
    fmt::print(stderr, "kphi: {}: no campaigns and no logs; `kphi run` and `kphi import` make them\n", request.folder);
  } else {
    print_table(campaigns);
  }
  return ExitCode::ok;
}

}  // namespace

void add_list(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<ListRequest>(
      program, exit_code, "list", "list campaigns and imported logs: date, propeller, K_T, verdict",
      "kphi list\nkphi list results --json", list);
  command.add_option("DIR", request.folder, "folder that holds campaigns' folders")
      ->type_name("")
      ->capture_default_str();
  command.add_flag("--json", request.json, "print one JSON array");
}

}  // namespace kphi::commands
