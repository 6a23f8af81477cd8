#include "commands/campaign_summary.hpp"

#include <filesystem>

#include "base/number.hpp"
#include "base/text.hpp"
#include "compensation/file/coefficient_file.hpp"
#include "fit/uncertainty/readiness.hpp"
#include "profiles/bench_config.hpp"
#include "profiles/campaign.hpp"
#include "profiles/plan.hpp"
#include "results/steps_csv.hpp"

namespace kphi::commands {
namespace {

namespace fs = std::filesystem;

/// Reads one file if it is there; what cannot be read becomes the summary's damage.
template <class Read>
void look_at(const fs::path& file, CampaignSummary& summary, Read&& read) {
  std::error_code none;
  if (!fs::exists(file, none)) return;
  try {
    read(file);
  } catch (const std::exception& error) {
    if (summary.damage.empty()) summary.damage = error.what();
  }
}

void take_journal(const fs::path& file, CampaignSummary& summary) {
  const results::JournalReading journal = results::read_journal(file);
  if (!journal.problems.empty()) summary.damage = journal.problems.front();
  if (journal.entries.empty()) return;
  summary.started_utc = journal.entries.front().utc;
  const results::CampaignState state = results::state_of(journal);
  summary.runs = state.accepted.size();
  for (const results::AcceptedRun& run : state.accepted) {
    summary.not_needed += static_cast<std::size_t>(std::max(0, run.steps_not_needed));
    const fs::path path = file.parent_path() / run.file;
    if (summary.damage.empty() && !fs::exists(path)) summary.damage = path.string() + ": missing, but in the journal";
  }
  summary.finished = state.finished;
  summary.safety_stop = state.safety_stop;
}

void take_campaign(const fs::path& file, CampaignSummary& summary) {
  const profiles::Campaign campaign = profiles::load_campaign(file.string());
  summary.campaign = campaign.name;
  summary.propeller = campaign.propeller.id;
  summary.operator_name = campaign.operator_name;
  summary.planned = profiles::make_plan(campaign, {}).runs.size();
}

void take_coefficients(const fs::path& file, CampaignSummary& summary) {
  const compensation::Coefficients fitted =
      compensation::load_coefficients(file.string(), compensation::Need::thrust_coefficient);
  summary.K_T = fitted.curve.thrust_coefficient().value();
  if (fitted.thrust_coefficient) summary.expanded_95 = fitted.thrust_coefficient->expanded_95;
  const auto readiness = fit::readiness_named(fitted.verdict);
  summary.verdict = readiness ? fit::words(*readiness) : fitted.verdict;
}

}  // namespace

CampaignSummary summary_of(const results::CampaignFolder& folder) {
  CampaignSummary summary;
  summary.folder = folder.path().string();
  look_at(folder.journal(), summary, [&](const fs::path& file) { take_journal(file, summary); });
  look_at(folder.bench_file(), summary,
          [&](const fs::path& file) { summary.origin = name_of(profiles::load_bench(file.string()).origin()); });
  look_at(folder.campaign_file(), summary, [&](const fs::path& file) { take_campaign(file, summary); });
  look_at(folder.steps(), summary, [&](const fs::path& file) {
    for (const results::StepMean& step : results::read_steps(file)) summary.steps.add(step.quality_flags);
  });
  look_at(folder.coefficients(), summary, [&](const fs::path& file) { take_coefficients(file, summary); });
  if (summary.started_utc.empty()) summary.runs = folder.complete_runs().size();
  return summary;
}

std::string CampaignSummary::progress() const {
  return planned == 0 ? fmt::format("{}", runs) : fmt::format("{} of {}", runs, std::max(runs, planned));
}

std::string CampaignSummary::coefficient() const {
  if (!K_T) return "not fitted";
  return expanded_95 ? with_error(*K_T, *expanded_95) : fmt::format("{:.5g}", *K_T);
}

std::string CampaignSummary::next() const {
  if (!damage.empty()) return "kphi verify " + folder;
  if (!finished && !started_utc.empty()) return "kphi run --bench BENCH --resume " + folder;
  if (steps.steps == 0) return "kphi replay " + folder;
  return K_T ? "" : "kphi fit " + folder;
}

Json to_json(const CampaignSummary& summary) {
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  Json json;
  KPHI_JSON_MEMBERS(json, summary, folder, origin, started_utc, campaign, propeller, operator_name, runs, planned,
                    not_needed, finished, safety_stop, verdict, damage);
  json["steps"] = summary.steps.steps;
  json["flagged"] = summary.steps.flagged;
  json["flags"] = results::flag_counts(summary.steps);
  json["K_T"] = number(summary.K_T);
  json["expanded_95"] = number(summary.expanded_95);
  json["next"] = summary.next();
  return json;
}

std::string to_text(const CampaignSummary& summary) {
  std::string text = summary.folder + "\n";
  const auto line = [&](const char* name, const std::string& value) {
    if (!value.empty()) text += fmt::format("  {:<11} {}\n", name, printable(value));
  };
  line("origin", summary.origin);
  line(summary.origin == name_of(Origin::simulated) ? "simulated" : "measured",
       summary.started_utc + (summary.operator_name.empty() ? "" : ", by " + summary.operator_name));
  line("campaign", summary.campaign);
  line("propeller", summary.propeller);
  line("runs", summary.progress() + (summary.finished || summary.started_utc.empty() ? "" : ", not finished"));
  if (summary.steps.steps > 0)
    line("steps", results::in_words(summary.steps) +
                      (summary.not_needed > 0 ? fmt::format("; {} not needed", summary.not_needed) : ""));
  line("safety stop", summary.safety_stop);
  line("K_T", summary.coefficient() + (summary.K_T ? " N/(rad/s)^2" : ""));
  line("verdict", summary.verdict);
  line("damage", summary.damage);
  line("next", summary.next());
  return text;
}

}  // namespace kphi::commands
