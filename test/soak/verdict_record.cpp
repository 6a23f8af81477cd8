#include <fmt/format.h>

#include <algorithm>

#include "profiles/plan.hpp"
#include "results/campaign_folder.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/steps_csv.hpp"
#include "test/soak/verdict_checks.hpp"

namespace kphi::soak {
namespace {

std::string name_of(const std::filesystem::path& path) { return path.filename().string(); }

/// Finished, renamed, and killed or refused before the journal could tell.
bool is_unannounced(const std::string& problem) { return problem.find("not in the journal") != std::string::npos; }

/// What was synced once can be read whatever happens, unless the program died while it wrote.
void check_readable(const Evidence& evidence, Lines& wrong) {
  const bool torn = evidence.killed() && evidence.mixture.kill && evidence.mixture.kill->at == Kill::At::write;
  for (const Unreadable& file : evidence.unreadable) {
    const bool promised = file.path.extension() != ".part" || (evidence.secured.contains(name_of(file.path)) && !torn);
    if (promised) wrong.push_back(fmt::format("record: {} cannot be read: {}", name_of(file.path), file.why));
  }
}

/// Resumed, and over before it had looked at what was left behind.
bool has_not_gone_on(const Evidence& evidence) {
  const std::size_t whole_lines = evidence.inherited.journal.size();
  return whole_lines > 0 && results::read_text(evidence.left->journal()).rfind('\n') + 1 == whole_lines;
}

void check_folder(const Evidence& evidence, Lines& wrong) {
  int unannounced = 0;
  const bool may_be_one = evidence.cut_short() || has_not_gone_on(evidence);
  for (const std::string& problem : results::verify_campaign(*evidence.left).problems) {
    if (may_be_one && is_unannounced(problem) && ++unannounced == 1) continue;
    wrong.push_back("record: " + problem);
  }
  for (const FileOfRun& file : evidence.files) {
    if (file.inherited) continue;
    if (file.path.extension() == ".part") {
      if (!evidence.cut_short()) wrong.push_back(fmt::format("record: {} is left over", file.name()));
    } else if (file.run.outcome != results::Outcome::complete) {
      for (const std::string& problem : results::verify_run(file.path).problems)
        wrong.push_back(fmt::format("record: {}: {}", file.name(), problem));
    }
  }
}

/// Files of the journal's accepted runs, in their order.
std::vector<std::string> accepted_runs(const results::JournalReading& journal) {
  std::vector<std::string> names;
  for (const auto& entry : journal.entries)
    if (entry.event == results::kRunAccepted) names.push_back(entry.data.at("file").get<std::string>());
  return names;
}

void check_steps(const Evidence& evidence, const std::vector<std::string>& accepted, Lines& wrong) {
  if (evidence.cut_short() || has_not_gone_on(evidence) || accepted.empty()) return;  // between two files
  std::vector<results::StepMean> again;
  for (const std::string& name : accepted) {
    const auto file = std::find_if(evidence.files.begin(), evidence.files.end(),
                                   [&](const FileOfRun& one) { return "runs/" + one.name() == name; });
    if (file != evidence.files.end()) again.insert(again.end(), file->steps.begin(), file->steps.end());
  }
  if (results::format_steps(again) != results::read_text(evidence.left->steps()))
    wrong.push_back("record: steps.csv is not the reduction of the accepted runs");
}

void check_journal(const Evidence& evidence, const results::JournalReading& journal, Lines& wrong) {
  const Story& story = evidence.story;
  if (evidence.cut_short()) return;
  const std::string expected = story.end == End::finished ? "campaign_finished" : "campaign_stopped";
  if (journal.entries.empty() || journal.entries.back().event != expected)
    return wrong.push_back(fmt::format("record: the journal does not end with {}", expected));
  if (story.end != End::finished && journal.entries.back().data.value("reason", "") != story.reason)
    wrong.push_back("record: the journal ends with another reason than the campaign");
}

/// Of a finished campaign.
void check_plan(const Evidence& evidence, const std::vector<std::string>& accepted, Lines& wrong) {
  if (evidence.story.end != End::finished) return;
  for (const auto& planned : profiles::make_plan(evidence.campaign, evidence.config).runs) {
    const std::string name =
        "runs/" + results::run_file_name(evidence.campaign.propeller.id, planned.occlusion_deg, planned.repetition);
    const auto times = std::count(accepted.begin(), accepted.end(), name);
    if (times != 1) wrong.push_back(fmt::format("record: finished, and {} was accepted {} times", name, times));
  }
}

/// Written anew each time, or not a file yet.
bool may_change(const std::string& name) {
  return name == "journal.jsonl" || name.ends_with(".csv") || (name.ends_with(".part") && !name.ends_with(".h5.part"));
}

}  // namespace

void check_record(const Evidence& evidence, Lines& wrong) {
  if (!evidence.left) return;
  check_readable(evidence, wrong);
  if (!std::filesystem::exists(evidence.left->journal())) return;
  check_folder(evidence, wrong);
  const auto journal = results::read_journal(evidence.left->journal());
  const auto accepted = accepted_runs(journal);
  check_steps(evidence, accepted, wrong);
  check_plan(evidence, accepted, wrong);
  // A program that was refused before it began has nothing to say in it.
  if (evidence.wire != nullptr) check_journal(evidence, journal, wrong);
}

void check_inheritance(const Evidence& evidence, Lines& wrong) {
  const Inheritance& inherited = evidence.inherited;
  if (inherited.files.empty() || !evidence.left) return;
  const auto files = files_below(evidence.left->path());
  const auto is_there = [&](const std::string& bytes) {
    return std::any_of(files.begin(), files.end(), [&](const auto& file) { return file.second == bytes; });
  };
  for (const auto& [name, bytes] : inherited.files) {
    const auto same = files.find(name);
    if (inherited.accepted.contains(name)) {
      if (same == files.end() || same->second != bytes)
        wrong.push_back(fmt::format("resumed: {} was accepted and is not what it was", name));
    } else if (!may_change(name) && !is_there(bytes)) {
      wrong.push_back(fmt::format("resumed: what {} held is lost", name));
    }
  }
  const auto journal = files.find("journal.jsonl");
  if (!inherited.journal.empty() && (journal == files.end() || !journal->second.starts_with(inherited.journal)))
    wrong.push_back("resumed: the journal does not go on where it ended");
  if (evidence.wire == nullptr && evidence.story.end == End::refused && files != inherited.files)
    wrong.push_back("resumed: refused before it began, and something was touched");
}

}  // namespace kphi::soak
