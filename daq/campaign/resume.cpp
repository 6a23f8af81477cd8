#include "daq/campaign/resume.hpp"

#include <fmt/format.h>

#include "base/error.hpp"
#include "profiles/strict_yaml.hpp"
#include "results/digest.hpp"
#include "results/file_layer.hpp"
#include "results/journal.hpp"
#include "results/version.hpp"

namespace kphi::daq {
namespace {

using nlohmann::json;

struct Kept {
  const char* key;
  const char* words;
  bool is_digest;  ///< a value that means nothing to a person
};
constexpr Kept kKept[] = {
    {"campaign_sha256", "the campaign file", true}, {"bench_sha256", "the bench file", true},
    {"faults_sha256", "the fault script", true},    {"motor_sha256", "the simulated motor's file", true},
    {"tool_version", "the program", false},         {"motor", "the motor module", false},
    {"load_cell", "the load cell", false},          {"supply", "the supply", false}};

}  // namespace

json identity_of(const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
  json identity{{"tool_version", kVersion},
                {"origin", name_of(config.origin())},
                {"campaign_sha256", results::sha256(campaign.text)},
                {"bench_sha256", results::sha256(config.text)}};
  const auto add = [&](const char* key, const std::string& file) {
    if (!file.empty()) identity[key] = results::sha256(profiles::read_text(file));
  };
  if (config.simulation) {
    add("faults_sha256", config.simulation->faults);
    add("motor_sha256", config.simulation->motor);
  }
  return identity;
}

void add_devices(json& identity, Bench& bench) {
  identity["motor"] = bench.motor().identity();
  const results::LoadCellScale cell = bench.load_cell().scale();
  identity["cell_serial"] = cell.serial;
  identity["load_cell"] = fmt::format("calibration {}, {:g} counts/N, {:g} counts/(N m)", cell.serial,
                                      cell.counts_per_newton, cell.counts_per_newton_metre);
  if (bench.supply() != nullptr) identity["supply"] = bench.supply()->identity();
}

std::vector<std::string> changes_since(const json& began, const json& now) {
  std::vector<std::string> changes;
  for (const Kept& kept : kKept) {
    if (!began.contains(kept.key) || !now.contains(kept.key) || began[kept.key] == now[kept.key]) continue;
    changes.push_back(kept.is_digest ? fmt::format("{} has changed", kept.words)
                                     : fmt::format("{} is \"{}\", was \"{}\"", kept.words,
                                                   now[kept.key].get<std::string>(), began.value(kept.key, "")));
  }
  return changes;
}

std::vector<std::string> require_unchanged(const results::CampaignFolder& folder, const Resumption& resumption,
                                           const json& now) {
  std::vector<std::string> changes = changes_since(resumption.state.identity, now);
  if (changes.empty() || resumption.accept_changes) return changes;
  throw ConfigurationError(
      fmt::format("{}: cannot resume: {}, so the runs would not be comparable; restore the original, or accept the "
                  "difference with --accept-changes",
                  folder.path().string(), fmt::join(changes, ", ")));
}

Resumption inspect(const results::CampaignFolder& folder, bool accept_changes) {
  Resumption resumption;
  resumption.accept_changes = accept_changes;
  if (!std::filesystem::exists(folder.journal())) return resumption;
  const results::JournalReading journal = results::read_journal(folder.journal());
  if (!journal.problems.empty()) {
    throw DataRejected(journal.problems.front() +
                       "; the following lines cannot be trusted; restore a copy, or start a new campaign");
  }
  resumption.state = results::state_of(journal);
  const std::vector<std::string> problems = results::changed_runs(folder, resumption.state);
  if (!problems.empty()) {
    throw DataRejected(fmt::format("{}; kphi never repeats an accepted run; restore a copy, or start a new campaign",
                                   fmt::join(problems, "; ")));
  }
  return resumption;
}

void keep_copy(const std::filesystem::path& copy, const std::string& text, results::FileLayer& files) {
  if (std::filesystem::exists(copy)) {
    const std::string former = results::read_text(copy);
    if (former == text) return;
    results::write_text(
        results::free_name((copy.parent_path() / copy.stem()).string() + ".replaced", copy.extension().string()),
        former, files);
  }
  results::write_text(copy, text, files);
}

}  // namespace kphi::daq
