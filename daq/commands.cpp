#include "daq/commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "daq/answering_operator.hpp"
#include "daq/bench_audit.hpp"
#include "daq/campaign_run.hpp"
#include "daq/dry_run.hpp"
#include "daq/interrupt.hpp"
#include "profiles/configuration_error.hpp"
#include "profiles/plan.hpp"
#include "results/file_layer.hpp"

namespace kphi::daq {
namespace {

struct RunOptions {
  std::string campaign;
  std::string bench;
  std::string out = "results";
  std::string answers;
  bool dry_run = false;
  bool yes = false;
  bool json = false;
};

bool stop_asked() { return SignalWatch::count() > 0; }

std::unique_ptr<Operator> person(const RunOptions& options, const std::optional<profiles::Answers>& answers) {
  if (answers) return std::make_unique<AnsweringOperator>(*answers);
  if (options.yes) return std::make_unique<AgreeingOperator>();
  if (!isatty(STDIN_FILENO)) {
    throw ConfigurationError(
        "kphi run: nobody to ask for the mountings: standard input is no terminal; name a file "
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

int run(const RunOptions& options) {
  const profiles::Campaign campaign = profiles::load_campaign(options.campaign);
  const profiles::Bench place = profiles::load_bench(options.bench);
  std::optional<profiles::Answers> answers;
  if (!options.answers.empty()) answers = profiles::load_answers(options.answers);
  if (options.dry_run) {
    const DryRun dry = dry_run(campaign, place, options.out, answers);
    put(stdout, options.json ? to_json(dry, campaign, place).dump() + "\n" : to_text(dry, campaign, place));
    return dry.ok() ? 0 : 2;
  }
  profiles::require_within(campaign, place);
  const DryRun dry = dry_run(campaign, place, options.out, answers);
  const profiles::Plan& plan = dry.plan;
  if (answers) profiles::require_mountings(*answers, plan.mounting_angles());
  put(stderr,
      fmt::format("{}\nCtrl-C lets the motor coast, closes the file and stops.\n", plan_text(campaign, place, plan)));
  for (const LimitCheck& check : dry.checks) {
    if (check.finding.severity != Severity::note) put(stderr, check.subject + ": " + check.finding.line() + "\n");
  }
  const auto operator_ = person(options, answers);
  const SignalWatch signals;
  std::filesystem::create_directories(options.out);
  const auto bench = connect(place);
  (void)audit_bench(*bench, campaign, place);  // before a folder is made; its words come with the run
  results::require_room(options.out, bytes_needed(plan, place), bench->files());
  const auto started = std::chrono::time_point_cast<std::chrono::seconds>(bench->clock().epoch_utc());
  const auto folder = results::CampaignFolder::create(
      options.out, fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(started))),
      campaign.name, bench->files());
  const auto progress = display();
  const CampaignResult result = run_campaign(*bench, campaign, place, folder, *operator_, *progress, stop_asked);
  summarise(result, folder, options.json);
  operator_->finish();
  return 0;
}

}  // namespace

void add_run(CLI::App& program, int& exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = program.add_subcommand("run", "run a campaign on a bench and record it");
  command->add_option("campaign", options->campaign, "campaign file")->required();
  command->add_option("--bench", options->bench, "bench file")->required();
  command->add_option("--out", options->out, "where the campaign's folder is made")->capture_default_str();
  command->add_flag("--dry-run", options->dry_run, "check every limit, print the plan, touch no device");
  auto* yes = command->add_flag("--yes", options->yes, "take every mounting as done (a simulated bench)");
  command->add_option("--answers", options->answers, "file with the operator's answers, for a run without a terminal")
      ->excludes(yes);
  command->add_flag("--json", options->json, "the result as one JSON object on stdout");
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace kphi::daq
