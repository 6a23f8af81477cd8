#include "daq/commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "daq/answering_operator.hpp"
#include "daq/awake.hpp"
#include "daq/bench_audit.hpp"
#include "daq/campaign_run.hpp"
#include "daq/console.hpp"
#include "daq/device_locks.hpp"
#include "daq/dry_run.hpp"
#include "daq/interrupt.hpp"
#include "daq/live/commands.hpp"
#include "profiles/configuration_error.hpp"
#include "profiles/plan.hpp"
#include "results/file_layer.hpp"

namespace kphi::daq {
namespace {

struct RunOptions {
  std::string campaign;
  std::string bench;
  std::string out = "results";
  std::string resume;  ///< a campaign's folder
  bool accept_changes = false;
  std::string answers;
  bool dry_run = false;
  bool yes = false;
  bool json = false;
  live::Wishes live;
};

std::unique_ptr<Operator> person(const RunOptions& options, const std::optional<profiles::Answers>& answers,
                                 const profiles::Bench& place, const std::function<bool()>& stop_asked) {
  if (answers) return std::make_unique<AnsweringOperator>(*answers);
  if (options.yes) return std::make_unique<AgreeingOperator>(place.simulation.has_value());
  if (!isatty(STDIN_FILENO)) {
    throw ConfigurationError(
        "kphi run: cannot ask for the mountings: standard input is not a terminal; name a file "
        "with the answers (--answers FILE), or use --yes if the bench mounts by itself");
  }
  return std::make_unique<TerminalOperator>(STDIN_FILENO, stderr, stop_asked);
}

std::unique_ptr<Progress> display() {
  const char* term = std::getenv("TERM");
  const bool dumb = term && std::string(term) == "dumb";
  if (isatty(STDERR_FILENO) && !dumb) return std::make_unique<TerminalProgress>(stderr);
  return std::make_unique<PlainProgress>(stderr);
}

void summarise(const CampaignResult& result, const results::CampaignFolder& folder, bool json) {
  if (json) {
    put(stdout, nlohmann::json{{"folder", folder.path().string()},
                               {"runs", result.runs},
                               {"samples", result.samples},
                               {"lost", result.lost},
                               {"steps", result.steps},
                               {"doubtful_steps", result.doubtful_steps}}
                        .dump() +
                    "\n");
  } else {
    put(stdout, folder.path().string() + "\n");
  }
  put(stderr, fmt::format("{} runs, {} samples, {} lost, {} of {} steps in doubt\nnext: kphi fit {}\n", result.runs,
                          result.samples, result.lost, result.doubtful_steps, result.steps, folder.path().string()));
}

profiles::Campaign campaign_of(const RunOptions& options) {
  if (!options.campaign.empty()) return profiles::load_campaign(options.campaign);
  if (options.resume.empty())
    throw ConfigurationError("kphi run: no campaign: name its file, or a folder with --resume");
  const auto file = results::CampaignFolder::open(options.resume).campaign_file();
  if (!std::filesystem::exists(file))
    throw ConfigurationError(options.resume +
                             ": holds no campaign.yaml: nothing was begun in it; name a campaign file");
  return profiles::load_campaign(file.string());
}

/// The folder that is written into, and how far it is.
struct Destination {
  std::optional<results::CampaignFolder> folder;
  std::optional<results::FileLock> lock;
  std::optional<Resumption> resumption;  ///< none: a new folder
  bool finished = false;                 ///< and nothing that it was made with has changed

  void open(const RunOptions& options, const profiles::Campaign& campaign, const profiles::Bench& place) {
    folder = results::CampaignFolder::open(options.resume);
    lock.emplace(lock_folder(*folder));
    resumption = look_at(*folder, options.accept_changes);
    nlohmann::json now = identity_of(campaign, place);
    nlohmann::json files = now;
    files.erase("tool_version");  // nothing is left for it to do
    finished = resumption->state.finished && changes_since(resumption->state.identity, files).empty();
    if (!finished) (void)require_unchanged(*folder, *resumption, now);
  }
  void create(const RunOptions& options, const profiles::Campaign& campaign, Bench& bench) {
    const auto started = std::chrono::time_point_cast<std::chrono::seconds>(bench.clock().epoch_utc());
    folder = results::CampaignFolder::create(
        options.out, fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(started))),
        campaign.name, bench.files());
    lock.emplace(lock_folder(*folder));
  }
  /// Of all runs, those that are still to be made.
  [[nodiscard]] double share_left(const profiles::Plan& plan) const {
    if (!resumption || plan.runs.empty()) return 1;
    return std::max(0.0,
                    1 - static_cast<double>(resumption->state.accepted.size()) / static_cast<double>(plan.runs.size()));
  }
};

/// After a safety stop only a person's own word lets the campaign continue: before any device is asked.
void clear_safety_stop(Destination& destination, Operator& person, const std::optional<profiles::Answers>& answers) {
  const bool is_stopped = destination.resumption && !destination.resumption->state.safety_stop.empty();
  if (is_stopped) {
    person.clear_safety_stop(destination.resumption->state.safety_stop);
    destination.resumption->cleared_by = person.name();
  } else if (answers && answers->continue_after_safety_stop) {
    throw ConfigurationError(
        answers->path + ": continue_after_safety_stop is left over: no safety stop ended this campaign; take it out");
  }
}

/// A computer that slept while its devices were connected: whatever they answered is of before.
std::unique_ptr<Bench> connect_awake(const profiles::Bench& place, const std::function<bool()>& stop_asked) {
  const SteadyClock wall;
  std::unique_ptr<Bench> bench;
  try {
    bench = connect(place, stop_asked);
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception&) {
    require_awake(wall);
    throw;
  }
  require_awake(wall);
  return bench;
}

int tell_finished(const Destination& destination, bool json) {
  const std::string folder = destination.folder->path().string();
  const std::size_t runs = destination.resumption->state.accepted.size();
  put(stdout, (json ? nlohmann::json{{"folder", folder}, {"runs", runs}}.dump() : folder) + "\n");
  put(stderr, fmt::format("{} is finished: its {} runs are accepted, nothing is left to resume\nnext: kphi fit {}\n",
                          folder, runs, folder));
  return 0;
}

int run(const RunOptions& options) {
  const profiles::Campaign campaign = campaign_of(options);
  const profiles::Bench place = profiles::load_bench(options.bench);
  std::optional<profiles::Answers> answers;
  if (!options.answers.empty()) answers = profiles::load_answers(options.answers);
  if (options.dry_run) {
    const DryRun dry = dry_run(campaign, place, options.out, answers);
    fmt::print("{}", options.json ? to_json(dry, campaign, place).dump() + "\n" : to_text(dry, campaign, place));
    return dry.ok() ? 0 : 2;
  }
  profiles::require_within(campaign, place);
  const DryRun dry = dry_run(campaign, place, options.out, answers);
  const profiles::Plan& plan = dry.plan;
  Destination destination;
  if (!options.resume.empty()) destination.open(options, campaign, place);
  if (destination.finished) return tell_finished(destination, options.json);
  // Resumed, only what is left is asked: the operator tells what is missing.
  if (answers && !destination.resumption) profiles::require_mountings(*answers, plan.mounting_angles());
  put(stderr,
      fmt::format("{}\nCtrl-C lets the motor coast, closes the file and stops.\n", plan_text(campaign, place, plan)));
  for (const LimitCheck& check : dry.checks) {
    if (check.finding.severity != Severity::note) put(stderr, check.subject + ": " + check.finding.line() + "\n");
  }
  live::View view(options.live, live::subject_of(campaign, place));
  put(stderr, live::greeting(view));
  const std::function<bool()> stop_asked = [&view] { return SignalWatch::count() > 0 || view.stop_asked(); };
  const auto operator_ = person(options, answers, place, stop_asked);
  clear_safety_stop(destination, *operator_, answers);
  const SignalWatch signals;
  const DeviceLocks devices(lock_names(place));
  if (!destination.folder) std::filesystem::create_directories(options.out);
  const auto bench = connect_awake(place, stop_asked);
  (void)audit_bench(*bench, campaign, place);  // before a folder is made; its words come with the run
  const auto bytes =
      static_cast<std::uint64_t>(destination.share_left(plan) * static_cast<double>(bytes_needed(plan, place)));
  results::require_room(destination.folder ? destination.folder->path().string() : options.out, bytes, bench->files());
  if (!destination.folder) destination.create(options, campaign, *bench);
  const auto terminal = display();
  const auto progress = view.beside(*terminal, bench->clock());
  const CampaignResult result = view.tell_the_end([&] {
    return run_campaign(*bench, campaign, place, *destination.folder, *operator_, *progress, stop_asked,
                        destination.resumption ? &*destination.resumption : nullptr);
  });
  summarise(result, *destination.folder, options.json);
  operator_->finish();
  return 0;
}

}  // namespace

void add_run(CLI::App& program, int& exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = program.add_subcommand("run", "run a campaign on a bench and record it");
  command->add_option("campaign", options->campaign,
                      "campaign file; with --resume that of the folder if none is named");
  command->add_option("--bench", options->bench, "bench file")->required();
  command->add_option("--out", options->out, "where the campaign's folder is made")->capture_default_str();
  command->add_option("--resume", options->resume, "continue the campaign of this folder at its first unfinished run")
      ->check(CLI::ExistingDirectory);
  command
      ->add_flag("--accept-changes", options->accept_changes,
                 "resume although files, program or devices are not what they were")
      ->needs("--resume");
  command->add_flag("--dry-run", options->dry_run, "check every limit, print the plan, touch no device");
  auto* yes = command->add_flag("--yes", options->yes, "take every mounting as done (a simulated bench)");
  command->add_option("--answers", options->answers, "file with the operator's answers, for a run without a terminal")
      ->excludes(yes);
  command->add_flag("--json", options->json, "the result as one JSON object on stdout");
  live::add_options(*command, options->live);
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace kphi::daq
