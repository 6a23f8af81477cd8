#include "daq/commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "daq/bench_audit.hpp"
#include "daq/campaign_run.hpp"
#include "daq/device_locks.hpp"
#include "daq/interrupt.hpp"
#include "profiles/configuration_error.hpp"
#include "profiles/plan.hpp"
#include "results/file_layer.hpp"
#include "results/run_writer.hpp"

namespace kphi::daq {
namespace {

struct RunOptions {
  std::string campaign;
  std::string bench;
  std::string out = "results";
  std::string resume;  ///< a campaign's folder
  bool accept_changes = false;
  bool dry_run = false;
  bool yes = false;
  bool json = false;
};

double time_scale(const profiles::Bench& place) { return place.simulation ? place.simulation->time_scale : 1.0; }

std::uint64_t bytes_needed(const profiles::Plan& plan, const profiles::Bench& place) {
  const auto readings = static_cast<std::uint64_t>(2 * place.iq.telemetry_hz * plan.bench.value());
  return results::RunWriter::bytes_needed(plan.samples, readings);
}

nlohmann::json plan_json(const profiles::Campaign& campaign, const profiles::Bench& place, const profiles::Plan& plan) {
  return {{"campaign", campaign.name},     {"propeller", campaign.propeller.id},
          {"runs", plan.runs.size()},      {"mountings", plan.mountings},
          {"steps", plan.steps},           {"spinning_s", plan.spinning.value()},
          {"bench_s", plan.bench.value()}, {"time_scale", time_scale(place)},
          {"samples", plan.samples},       {"bytes", bytes_needed(plan, place)}};
}

std::string plan_text(const profiles::Campaign& campaign, const profiles::Bench& place, const profiles::Plan& plan) {
  const auto& profile = campaign.profile;
  std::string angles;
  for (const double angle : campaign.occlusions_deg) angles += fmt::format(" {:g}°", angle);
  return fmt::format(
      "{}: propeller {} ({}), occlusions{}, {} repetitions\n"
      "  {} runs of {} steps, {:.0f} to {:.0f} RPM, {:g} s each; {} mountings\n"
      "  {:.0f} min spinning, {:.0f} min on the bench{}, {:.1f} million samples, {:.2f} GB",
      campaign.name, campaign.propeller.id, campaign.propeller.name, angles, campaign.repetitions, plan.runs.size(),
      profile.steps, to_rpm(profile.first), to_rpm(profile.last), profile.dwell.value(), plan.mountings,
      plan.spinning.value() / 60, plan.bench.value() / 60,
      time_scale(place) > 1 ? fmt::format(" ({:g} times as fast here)", time_scale(place)) : "",
      1e-6 * static_cast<double>(plan.samples), 1e-9 * static_cast<double>(bytes_needed(plan, place)));
}

bool stop_asked() { return SignalWatch::count() > 0; }

std::unique_ptr<Operator> person(const RunOptions& options) {
  if (options.yes) return std::make_unique<AgreeingOperator>();
  if (!isatty(STDIN_FILENO)) {
    throw ConfigurationError(
        "kphi run: nobody to ask for the mountings: standard input is no terminal; use --yes if "
        "the bench mounts by itself");
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
  profiles::require_within(campaign, place);
  const profiles::Plan plan = profiles::make_plan(campaign, place);
  if (options.dry_run) {
    if (options.json)
      fmt::print("{}\n", plan_json(campaign, place, plan).dump());
    else
      fmt::print("{}\n", plan_text(campaign, place, plan));
    return 0;
  }
  Destination destination;
  if (!options.resume.empty()) destination.open(options, campaign, place);
  if (destination.finished) return tell_finished(destination, options.json);
  put(stderr,
      fmt::format("{}\nCtrl-C lets the motor coast, closes the file and stops.\n", plan_text(campaign, place, plan)));
  const auto operator_ = person(options);
  const SignalWatch signals;
  const DeviceLocks devices(lock_names(place));
  if (!destination.folder) std::filesystem::create_directories(options.out);
  const auto bench = connect(place);
  (void)audit_bench(*bench, campaign, place);  // before a folder is made; its words come with the run
  const auto bytes =
      static_cast<std::uint64_t>(destination.share_left(plan) * static_cast<double>(bytes_needed(plan, place)));
  results::require_room(destination.folder ? destination.folder->path().string() : options.out, bytes, bench->files());
  if (!destination.folder) destination.create(options, campaign, *bench);
  const auto progress = display();
  const CampaignResult result = run_campaign(*bench, campaign, place, *destination.folder, *operator_, *progress,
                                             stop_asked, destination.resumption ? &*destination.resumption : nullptr);
  summarise(result, *destination.folder, options.json);
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
  command->add_option("--resume", options->resume, "go on with the campaign of this folder at its first unfinished run")
      ->check(CLI::ExistingDirectory);
  command
      ->add_flag("--accept-changes", options->accept_changes,
                 "resume although files, program or devices are not what they were")
      ->needs("--resume");
  command->add_flag("--dry-run", options->dry_run, "check everything, print the plan, touch no device");
  command->add_flag("--yes", options->yes, "take every mounting as done (a simulated bench)");
  command->add_flag("--json", options->json, "the result as one JSON object on stdout");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace kphi::daq
