#include <fmt/chrono.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "commands/at_the_bench.hpp"
#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/so_far.hpp"
#include "daq/audit/bench_audit.hpp"
#include "daq/campaign/campaign_run.hpp"
#include "daq/campaign/dry_run.hpp"
#include "daq/campaign/operator.hpp"
#include "daq/campaign/resume.hpp"
#include "daq/guard/interlock.hpp"
#include "daq/guard/run_stopped.hpp"
#include "daq/hardware/device_locks.hpp"
#include "daq/run/console.hpp"
#include "profiles/plan.hpp"
#include "results/file_layer.hpp"

namespace kphi::commands {
namespace {

using namespace daq;

struct RunOptions {
  std::string campaign;
  std::string bench;
  std::string out = "results";
  std::string resume;  ///< a campaign's folder
  bool accept_changes = false;
  std::string answers;
  std::vector<std::string> wishes;
  bool dry_run = false;
  bool yes = false;
  bool json = false;
  live::LiveOptions live;
};

std::unique_ptr<Operator> person(const RunOptions& options, const std::optional<profiles::Answers>& answers,
                                 const profiles::BenchConfig& config, Terminal& terminal, const StopAsked& stop_asked) {
  if (answers) return std::make_unique<AnsweringOperator>(*answers);
  if (options.yes) return std::make_unique<AutoConfirmOperator>(config.simulation.has_value());
  if (!isatty(STDIN_FILENO)) {
    throw ConfigurationError(
        "kphi run: cannot ask for the mountings: standard input is not a terminal; name a file "
        "with the answers (--answers FILE), or use --yes if the bench mounts by itself");
  }
  return std::make_unique<TerminalOperator>(terminal, stderr, stop_asked);
}

void summarise(const CampaignResult& result, const std::string& folder, bool json) {
  const nlohmann::json all{{"folder", folder},
                           {"runs", result.runs},
                           {"samples", result.samples},
                           {"lost", result.lost},
                           {"steps", result.steps.steps},
                           {"flagged_steps", result.steps.flagged},
                           {"flags", results::flag_counts(result.steps)}};
  put(stdout, (json ? all.dump() : folder) + "\n");
  put(stderr, fmt::format("{} runs, {} samples, {} lost, {}\nnext: kphi fit {}\n", result.runs, result.samples,
                          result.lost, results::in_words(result.steps), folder));
}

profiles::Campaign campaign_of(const RunOptions& options) {
  if (!options.campaign.empty()) return profiles::load_campaign(options.campaign);
  if (options.resume.empty())
    throw ConfigurationError("kphi run: no campaign; give its file, or a folder with --resume");
  const auto file = results::CampaignFolder::open(options.resume).campaign_file();
  if (!std::filesystem::exists(file))
    throw ConfigurationError(options.resume + ": no campaign.yaml in this folder; give a campaign file");
  return profiles::load_campaign(file.string());
}

/// Where files will be made, or the parent of it.
std::filesystem::path folder_of(const RunOptions& options) {
  return options.resume.empty() ? options.out : options.resume;
}

/// The campaign's folder, and how far it is.
struct Destination {
  std::optional<results::CampaignFolder> folder;
  std::optional<results::FileLock> lock;
  std::optional<Resumption> resumption;  ///< nullopt: a new folder
  bool finished = false;                 ///< with unchanged files

  void open(const RunOptions& options, const profiles::Campaign& campaign, const profiles::BenchConfig& config) {
    folder = results::CampaignFolder::open(options.resume);
    lock.emplace(lock_folder(*folder));
    resumption = inspect(*folder, options.accept_changes);
    nlohmann::json now = identity_of(campaign, config);
    nlohmann::json files = now;
    files.erase("tool_version");  // a finished campaign needs no program
    finished = resumption->state.finished && changes_since(resumption->state.identity, files).empty();
    if (!finished) (void)require_unchanged(*folder, *resumption, now);
  }
  void create(const RunOptions& options, const profiles::Campaign& campaign, Bench& bench) {
    folder = results::CampaignFolder::create(options.out, stamp_of(bench), campaign.name, bench.files());
    lock.emplace(lock_folder(*folder));
  }
  /// Share of the runs that are still to be made.
  [[nodiscard]] double share_left(const profiles::Plan& plan) const {
    if (!resumption || plan.runs.empty()) return 1;
    return std::max(0.0,
                    1 - static_cast<double>(resumption->state.accepted.size()) / static_cast<double>(plan.runs.size()));
  }
};

/// After a safety stop only a person may let the campaign continue, before any device is connected.
void clear_safety_stop(Destination& destination, Operator& person, const std::optional<profiles::Answers>& answers) {
  const bool is_stopped = destination.resumption && !destination.resumption->state.safety_stop.empty();
  if (is_stopped) {
    person.clear_safety_stop(destination.resumption->state.safety_stop);
    destination.resumption->cleared_by = person.name();
  } else if (answers && answers->continue_after_safety_stop) {
    throw ConfigurationError(
        answers->path + ": continue_after_safety_stop is not needed: no safety stop ended this campaign; remove it");
  }
}

ExitCode print_finished(const Destination& destination, bool json) {
  const std::string folder = destination.folder->path().string();
  const std::size_t runs = destination.resumption->state.accepted.size();
  put(stdout, (json ? nlohmann::json{{"folder", folder}, {"runs", runs}}.dump() : folder) + "\n");
  put(stderr, fmt::format("{} is finished: all {} runs accepted, nothing left to resume\nnext: kphi fit {}\n", folder,
                          runs, folder));
  return ExitCode::ok;
}

/// What the command line and the files ask for.
struct RunRequest {
  const RunOptions& options;
  profiles::Campaign campaign;
  profiles::BenchConfig config;
  std::optional<profiles::Answers> answers;
};

ExitCode print_plan(const RunRequest& request) {
  announce_origin(request.config);
  const auto& [options, campaign, config, answers] = request;
  const DryRun dry = dry_run(campaign, config, folder_of(options), answers);
  fmt::print("{}", options.json ? to_json(dry, campaign, config).dump() + "\n" : to_text(dry, campaign, config));
  return dry.ok() ? ExitCode::ok : ExitCode::usage;
}

/// What no later check would say before the first device turns or the folder is made. Of a resumed campaign, what its
/// disk refuses.
void require_possible(const DryRun& dry, bool resumed) {
  for (const Finding& finding : dry.files)
    if (finding.severity == Severity::fault) throw ConfigurationError(finding.words());
  for (const PlanCheck& check : dry.checks)
    if (!resumed && check.finding.severity == Severity::fault)
      throw ConfigurationError(check.subject + ": " + check.finding.words());
}

void announce(const RunRequest& request, const DryRun& dry) {
  announce_origin(request.config);
  put(stderr, plan_text(request.campaign, request.config, dry.plan) +
                  "\nCtrl-C coasts the motor, closes the file and stops.\n");
  for (const PlanCheck& check : dry.checks)
    if (check.finding.severity != Severity::note) put(stderr, check.subject + ": " + check.finding.line() + "\n");
}

/// Connects, checks devices and disk, makes the folder, and runs what is left of the campaign.
void execute(const RunRequest& request, const profiles::Plan& plan, Destination& destination, Operator& person,
             live::LiveSession& view, const std::function<bool()>& stop_asked) {
  const SoFar known = so_far(request.campaign, request.options.wishes);
  const RunOptions& options = request.options;
  const profiles::Campaign& campaign = request.campaign;
  const profiles::BenchConfig& config = request.config;
  const auto devices = lock_devices(lock_names(config));
  if (!destination.folder) std::filesystem::create_directories(options.out);
  const auto bench = connect_awake(config, stop_asked);
  leave_without_power(*bench, [&] {
    const std::vector<BenchFinding> findings =
        audit_bench(*bench, campaign, config);  // faults throw before a folder is made
    const auto bytes = static_cast<std::uint64_t>(
        destination.share_left(plan) * static_cast<double>(bytes_needed(longest_plan(campaign, config), config)));
    results::require_room(destination.folder ? destination.folder->path().string() : options.out, bytes,
                          bench->files());
    if (!destination.folder) destination.create(options, campaign, *bench);
    PrintedProgress printed(stderr, has_terminal());
    const auto progress = view.beside(printed, bench->clock());
    const CampaignResult result = view.tell_the_end([&] {
      return run_campaign(*bench, campaign, config, *destination.folder, person, *progress, stop_asked,
                          destination.resumption ? &*destination.resumption : nullptr, &findings, known);
    });
    summarise(result, destination.folder->path().string(), options.json);
  });
}

ExitCode run(const RunOptions& options) {
  RunRequest request{options, campaign_of(options), profiles::load_bench(options.bench), std::nullopt};
  if (!options.answers.empty()) request.answers = profiles::load_answers(options.answers);
  (void)so_far(request.campaign, options.wishes);  // before anything happens
  if (options.dry_run) return print_plan(request);
  const auto& [unused, campaign, config, answers] = request;
  profiles::require_within(campaign, config);
  Destination destination;
  if (!options.resume.empty()) destination.open(options, campaign, config);
  if (destination.finished) return print_finished(destination, options.json);
  const DryRun dry = dry_run(campaign, config, folder_of(options), answers);
  require_possible(dry, destination.resumption.has_value());
  // A resumption asks only for the missing runs: the operator reports missing answers.
  if (answers && !destination.resumption) profiles::require_mountings(*answers, dry.plan);
  const SignalWatch signals;  // before the words that promise it
  announce(request, dry);
  live::LiveSession view(options.live, live::subject_of(campaign, config));
  put(stderr, live_greeting(view));
  const StopAsked end_asked = [&view] { return SignalWatch::count() > 0 || view.stop_asked(); };
  const StopAsked stop_asked = [&] { return end_asked() || SignalWatch::is_suspension_asked(); };
  Terminal terminal(STDIN_FILENO, stderr);
  const auto operator_ = person(options, answers, config, terminal, end_asked);
  clear_safety_stop(destination, *operator_, answers);
  if (const auto doubts = profiles::doubts_of(campaign); !doubts.empty() && !destination.resumption)
    operator_->accept_doubts(fmt::format("{}", fmt::join(doubts, "\n")));
  execute(request, dry.plan, destination, *operator_, view, stop_asked);
  operator_->finish();
  return ExitCode::ok;
}

}  // namespace

void add_run(CLI::App& program, ExitCode& exit_code) {
  const auto [command, options] =
      add_verb<RunOptions>(program, exit_code, "run", "run a campaign on a bench and record it",
                           "kphi run my_campaign.yaml --bench my_bench.yaml --live\nkphi run --bench my_bench.yaml "
                           "--resume results/<folder>",
                           run);
  command
      .add_option("CAMPAIGN", options.campaign, "campaign file (optional with --resume: default is the folder's copy)")
      ->type_name("");
  add_value(command, "--bench", "FILE", options.bench, "bench file")->required();
  add_value(command, "--out", "DIR", options.out, "parent folder of the campaign's folder")->capture_default_str();
  command.add_flag("--dry-run", options.dry_run, "check and print the plan and every limit; touch no device");
  add_value(command, "--resume", "DIR", options.resume,
            "resume the campaign of this folder at its first unfinished run")
      ->check(kExistingFolder);
  command.add_flag("--accept-changes", options.accept_changes, "resume although files, program or devices changed")
      ->needs("--resume");
  add_value(command, "--want", "\"WHAT PERCENT %\"", options.wishes,
            "after each run, tell how far it is to this (see kphi plan); may be repeated")
      ->allow_extra_args(false);
  add_live_options(command, options.live);
  begin_group(command, "Without a person");
  auto* yes = command.add_flag("--yes", options.yes, "take every mounting as done (for a simulated bench)");
  add_value(command, "--answers", "FILE", options.answers,
            "file with the operator's answers, for a run without a terminal")
      ->excludes(yes);
  command.add_flag("--json", options.json, "print the result as one JSON object");
}

}  // namespace kphi::commands
