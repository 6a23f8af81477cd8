#include "results/campaign_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include "base/error.hpp"
#include "base/number.hpp"
#include "base/ordered_work.hpp"
#include "base/text.hpp"
#include "results/checksums.hpp"
#include "results/digest.hpp"
#include "results/run_reader.hpp"

namespace kphi::results {
namespace {

std::string file_name_safe(std::string text) {
  for (char& c : text) {
    if (!std::isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '_' && c != '-') c = '_';
  }
  return text;
}

struct RunName {
  double occlusion_deg = 0;
  int repetition = 0;
  std::string propeller;
};

/// Inverse of run_file_name(); nullopt for other files.
std::optional<RunName> parse_run_name(const std::string& name) {
  const std::size_t phi = name.rfind("_phi");
  const std::size_t place = std::min(name.find("_rep", phi), name.find("_ref", phi));
  if (!name.ends_with(".h5") || phi == std::string::npos || place == std::string::npos) return std::nullopt;
  const auto angle = parse_double(name.substr(phi + 4, place - phi - 4));
  const auto number = parse_integer<int>(name.substr(place + 4, name.size() - 3 - place - 4));
  if (!angle || !number) return std::nullopt;
  const int sign = name[place + 3] == 'f' ? -1 : 1;
  return RunName{*angle, sign * *number, name.substr(0, phi)};
}

constexpr const char* kNoFile = ": is a link, a folder, a pipe or a device; put the file itself into its place";

/// A link may lead to anything, a pipe may never end.
bool is_file_or_nothing(const std::filesystem::path& path) {
  const auto there = std::filesystem::symlink_status(path);
  return !std::filesystem::exists(there) || std::filesystem::is_regular_file(there);
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  if (!std::filesystem::is_directory(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

/// By place of the occlusion in `occlusions_deg`, occlusion, number and propeller.
std::vector<std::filesystem::path> complete_files(const std::filesystem::path& folder, bool references,
                                                  std::span<const double> occlusions_deg) {
  using Key = std::tuple<std::ptrdiff_t, double, int, std::string>;
  std::multimap<Key, std::filesystem::path> found;
  for (const auto& file : files_in(folder)) {
    const auto name = parse_run_name(file.filename().string());
    if (!name || (name->repetition < 0) != references) continue;
    const auto place = std::ranges::find(occlusions_deg, name->occlusion_deg) - occlusions_deg.begin();
    if (!is_file_or_nothing(file)) throw DataRejected(file.string() + kNoFile);
    found.emplace(Key{place, name->occlusion_deg, std::abs(name->repetition), name->propeller}, file);
  }
  std::vector<std::filesystem::path> paths;
  for (auto& [key, file] : found) paths.push_back(std::move(file));
  return paths;
}

constexpr std::string_view kPart = ".h5.part";
constexpr std::string_view kRun = ".h5";

std::string set_aside(const CampaignFolder& folder, const std::filesystem::path& file, std::string_view ending,
                      const std::string& becomes, FileLayer& files) {
  std::string stem = file.string();
  stem.resize(stem.size() - ending.size());
  return on_disk(file.string(), [&] {
    const std::filesystem::path to = free_name(stem + becomes, std::string(ending));
    files.rename(file, to);
    files.sync_folder(folder.runs());
    return "runs/" + to.filename().string();
  });
}

/// Run (relative to the folder) → SHA-256, as last written down.
std::map<std::string, std::string> digests_of_runs(const JournalReading& journal) {
  std::map<std::string, std::string> digests;
  for (const auto& [n, time_ns, utc, event, data] : journal.entries)
    if (data.contains("file") && data.contains("sha256")) digests[data["file"]] = data["sha256"];
  return digests;
}

/// Copies of the campaign's files → SHA-256, of its last beginning.
std::map<std::string, std::string> digests_of_copies(const CampaignFolder& folder, const JournalReading& journal) {
  std::map<std::string, std::string> digests;
  const nlohmann::json identity = state_of(journal).identity;
  const std::pair<const char*, std::filesystem::path> copies[] = {{"campaign_sha256", folder.campaign_file()},
                                                                  {"bench_sha256", folder.bench_file()},
                                                                  {"faults_sha256", folder.faults_file()},
                                                                  {"motor_sha256", folder.motor_file()}};
  for (const auto& [key, path] : copies)
    if (identity.is_object() && identity.contains(key) && identity[key].is_string())
      digests[path.filename().string()] = identity[key];
  return digests;
}

/// Adds a problem unless the file is the one of the journal.
void check_file(const std::filesystem::path& path, const std::string& sha256, std::vector<std::string>& problems) {
  if (!is_file_or_nothing(path)) {
    problems.push_back(path.string() + kNoFile);
  } else if (!std::filesystem::exists(path)) {
    problems.push_back(path.string() + ": missing, but in the journal");
  } else if (sha256_of_file(path) != sha256) {
    problems.push_back(path.string() + ": SHA-256 does not match the journal");
  }
}

/// Adds a problem unless the folder holds them as given.
void check_files(const CampaignFolder& folder, const std::map<std::string, std::string>& digests,
                 std::vector<std::string>& problems) {
  for (const auto& [file, digest] : digests) check_file(folder.path() / file, digest, problems);
}

DataRejected changed_run(const std::string& problem) {
  return DataRejected(problem + "; restore it from a copy, or repeat the run");
}

/// Copying or version control may have made it writable; the SHA-256 shows whether anybody changed it.
bool is_writable(const std::filesystem::path& path) {
  using std::filesystem::perms;
  std::error_code none;
  const perms all = std::filesystem::status(path, none).permissions();
  return (all & (perms::owner_write | perms::group_write | perms::others_write)) != perms::none;
}

}  // namespace

std::string run_file_name(const std::string& propeller_id, double occlusion_deg, int repetition) {
  std::string angle = shortest(occlusion_deg);
  const std::size_t whole = std::min(angle.find('.'), angle.size());
  if (whole < 3) angle.insert(0, 3 - whole, '0');
  return fmt::format("{}_phi{}_{}{}.h5", file_name_safe(propeller_id), angle, repetition < 0 ? "ref" : "rep",
                     std::abs(repetition));
}

bool is_complete_run(const std::string& name) { return parse_run_name(name).has_value(); }

CampaignFolder CampaignFolder::create(const std::filesystem::path& parent, const std::string& utc,
                                      const std::string& name, FileLayer& files) {
  const std::string base = (parent / file_name_safe(utc + "_" + name)).string();
  return on_disk(base, [&] {
    std::filesystem::create_directories(parent);
    std::filesystem::path path = base;
    for (int i = 2; !std::filesystem::create_directory(path); ++i) path = fmt::format("{}-{}", base, i);
    CampaignFolder folder(path);
    std::filesystem::create_directory(folder.runs());
    std::filesystem::create_directory(folder.figures());
    files.sync_folder(folder.path());
    files.sync_folder(parent);
    return folder;
  });
}

CampaignFolder CampaignFolder::open(const std::filesystem::path& path) {
  CampaignFolder folder(path.has_filename() ? path : path.parent_path());
  for (const auto& file :
       {folder.journal(), folder.campaign_file(), folder.bench_file(), folder.faults_file(), folder.motor_file(),
        folder.steps(), folder.means(), folder.references(), folder.coefficients(), folder.report(), path / kSumsFile})
    if (!is_file_or_nothing(file)) throw DataRejected(file.string() + kNoFile);
  if (std::filesystem::exists(folder.journal()) || std::filesystem::is_directory(folder.runs())) return folder;
  throw RecordError(path.string() +
                    ": not a campaign folder: no journal.jsonl and no runs/ in it; name a folder made by kphi run");
}

std::vector<std::filesystem::path> CampaignFolder::complete_runs(std::span<const double> occlusions_deg) const {
  return complete_files(runs(), false, occlusions_deg);
}

std::vector<std::filesystem::path> CampaignFolder::reference_runs() const { return complete_files(runs(), true, {}); }

std::vector<std::filesystem::path> CampaignFolder::other_runs() const {
  std::vector<std::filesystem::path> paths = files_in(runs());
  std::erase_if(paths, [](const auto& file) { return parse_run_name(file.filename().string()).has_value(); });
  return paths;
}

CampaignState state_of(const JournalReading& journal) {
  const auto text = [](const JournalEntry& entry, const char* key) {
    const auto found = entry.data.find(key);
    return found != entry.data.end() && found->is_string() ? found->get<std::string>() : std::string();
  };
  const auto number = [](const JournalEntry& entry, const char* key) {
    const auto found = entry.data.find(key);
    return found != entry.data.end() && found->is_number_integer() ? found->get<int>() : 0;
  };
  CampaignState state;
  for (const JournalEntry& entry : journal.entries) {
    if (entry.event == kCampaignStarted || entry.event == kCampaignResumed) state.identity = entry.data;
    if (entry.event == kCampaignResumed) state.safety_stop.clear();
    if (const auto stop = entry.data.find("safety_stop"); stop != entry.data.end() && *stop == true) {
      state.safety_stop = text(entry, "reason");
      if (state.safety_stop.empty()) state.safety_stop = "unknown cause";
    }
    state.finished = entry.event == kCampaignFinished;
    if (entry.event != kRunAccepted) continue;
    AcceptedRun run{text(entry, "file"),
                    {text(entry, "sha256"), text(entry, "contents_xxh128")},
                    entry.time_ns,
                    number(entry, "steps_not_needed")};
    if (!run.file.empty() && !run.digests.sha256.empty()) state.accepted.push_back(std::move(run));
  }
  return state;
}

std::vector<std::string> changed_runs(const CampaignFolder& folder, const CampaignState& state) {
  std::vector<std::string> problems;
  OrderedWork<std::vector<std::string>> checks(
      [&](const std::vector<std::string>& found) { problems.insert(problems.end(), found.begin(), found.end()); });
  for (const AcceptedRun& run : state.accepted)
    checks.add(std::launch::async, [&folder, &run] {
      std::vector<std::string> found;
      check_file(folder.path() / run.file, run.digests.sha256, found);
      return found;
    });
  checks.finish();
  return problems;
}

std::map<std::string, RunDigests> digests_beside(const std::filesystem::path& run) {
  std::map<std::string, RunDigests> digests;
  const std::filesystem::path runs = std::filesystem::absolute(run).parent_path();
  const std::filesystem::path journal = runs.parent_path() / "journal.jsonl";
  if (runs.filename() != "runs" || !std::filesystem::exists(journal)) return digests;
  for (const AcceptedRun& accepted : state_of(read_journal(journal)).accepted)
    digests[std::filesystem::path(accepted.file).filename().string()] = accepted.digests;
  return digests;
}

void require_unchanged_run(const std::filesystem::path& run, const std::map<std::string, RunDigests>& digests) {
  std::vector<std::string> problems;
  if (const auto known = digests.find(run.filename().string()); known != digests.end())
    check_file(run, known->second.sha256, problems);
  else if (run.extension() == ".h5")
    problems = verify_run(run).problems;
  if (!problems.empty()) throw changed_run(with_file(run, problems.front()));
}

RunRecording read_unchanged_run(const std::filesystem::path& run, const std::map<std::string, RunDigests>& digests,
                                LoadCellColumns& cell) {
  const auto known = digests.find(run.filename().string());
  if (known == digests.end() || known->second.contents_xxh128.empty()) {
    require_unchanged_run(run, digests);
    return read_run(run, cell);
  }
  try {
    RunRecording recording = read_run(run, cell);
    if (recording.contents_xxh128 == known->second.contents_xxh128) return recording;
  } catch (const RecordError&) {  // whether it was changed is the better message
    require_unchanged_run(run, digests);
    throw;
  }
  require_unchanged_run(run, digests);
  throw changed_run(run.string() + ": its SHA-256 matches the journal, but contents_xxh128 does not");
}

std::vector<std::string> set_leftovers_aside(const CampaignFolder& folder, const CampaignState& state,
                                             FileLayer& files) {
  std::vector<std::string> names;
  for (const auto& file : folder.complete_runs()) {
    const std::string name = "runs/" + file.filename().string();
    const bool accepted = std::ranges::any_of(state.accepted, [&](const AcceptedRun& run) { return run.file == name; });
    if (!accepted) names.push_back(set_aside(folder, file, kRun, ".unaccepted", files));
  }
  for (const auto& file : folder.other_runs()) {
    const std::string name = file.filename().string();
    if (!name.ends_with(kPart) || name.find(".interrupted") != std::string::npos) continue;
    names.push_back(set_aside(folder, file, kPart, ".interrupted", files));
  }
  return names;
}

FilesBeside files_beside(const CampaignFolder& folder, const JournalReading& journal) {
  FilesBeside found;
  check_files(folder, digests_of_copies(folder, journal), found.problems);
  std::map<std::string, std::string> tables;
  bool old = false;
  for (const JournalEntry& entry : journal.entries) {
    if (entry.event == kRunAccepted) old = true;
    if (entry.event != kTablesWritten || !entry.data.contains("files")) continue;
    old = false;
    for (const auto& [file, digest] : entry.data["files"].items()) tables[file] = digest;
  }
  if (!old) check_files(folder, tables, found.problems);
  if (old)
    found.remarks.push_back(folder.steps().string() +
                            ": not written again after the last run; kphi run --resume or kphi replay computes it");
  return found;
}

void require_intact(const CampaignFolder& folder, const std::function<void(const std::string&)>& remark) {
  if (!std::filesystem::exists(folder.journal())) return;
  const JournalReading journal = read_journal(folder.journal());
  std::vector<std::string> problems = journal.problems;
  if (problems.empty()) {
    FilesBeside beside = files_beside(folder, journal);
    for (const std::string& text : beside.remarks)
      if (remark) remark(text);
    problems = std::move(beside.problems);
  }
  if (problems.empty()) problems = changed_runs(folder, state_of(journal));
  if (!problems.empty())
    throw DataRejected(
        fmt::format("{0}; nothing is taken from it: `kphi verify {1}` lists all, `kphi replay {1}` computes the tables "
                    "again from the "
                    "runs, and a table of your own is fitted by its name",
                    problems.front(), folder.path().string()));
}

CampaignVerification verify_campaign(const CampaignFolder& folder) {
  CampaignVerification found;
  std::map<std::string, std::string> digests;
  if (std::filesystem::exists(folder.journal())) {
    const JournalReading journal = read_journal(folder.journal());
    found.entries = journal.entries.size();
    found.torn_last_line = journal.torn_last_line;
    found.problems = journal.problems;
    digests = digests_of_runs(journal);
    const FilesBeside beside = files_beside(folder, journal);
    found.problems.insert(found.problems.end(), beside.problems.begin(), beside.problems.end());
    found.remarks = beside.remarks;
  } else {
    found.problems.push_back(folder.journal().string() + ": missing");
  }
  check_files(folder, digests, found.problems);
  try {
    std::vector<std::filesystem::path> made{folder.coefficients(), folder.report()};
    for (const auto& figure : files_in(folder.figures()))
      if (figure.extension() == ".svg") made.push_back(figure);
    for (std::string& problem : unlike_sums(folder.path(), made)) found.problems.push_back(std::move(problem));
  } catch (const DataRejected& error) {
    found.problems.emplace_back(error.what());
  }
  std::vector<std::filesystem::path> runs = folder.complete_runs();
  for (const auto& path : folder.reference_runs()) runs.push_back(path);
  if (const auto writable = std::ranges::count_if(runs, is_writable); writable > 0)
    found.remarks.push_back(
        fmt::format("{}: {} of {} runs are writable; run chmod a-w on them, if this disk knows that",
                    folder.runs().string(), writable, runs.size()));
  for (const auto& path : runs) {
    ++found.runs;
    for (const std::string& problem : verify_run(path).problems) found.problems.push_back(with_file(path, problem));
    if (!digests.contains("runs/" + path.filename().string()))
      found.problems.push_back(path.string() + ": not in the journal");
  }
  return found;
}

}  // namespace kphi::results
