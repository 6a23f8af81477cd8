#include "daq/commands.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "daq/bench_audit.hpp"
#include "daq/campaign_run.hpp"
#include "daq/interrupt.hpp"
#include "daq/live/commands.hpp"
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
  bool dry_run = false;
  bool yes = false;
  bool json = false;
  live::Wishes live;
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

std::unique_ptr<Operator> person(const RunOptions& options, const std::function<bool()>& stop_asked) {
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

int run(const RunOptions& options) {
  const profiles::Campaign campaign = profiles::load_campaign(options.campaign);
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
  put(stderr,
      fmt::format("{}\nCtrl-C lets the motor coast, closes the file and stops.\n", plan_text(campaign, place, plan)));
  live::View view(options.live, live::subject_of(campaign));
  put(stderr, live::greeting(view));
  const std::function<bool()> stop_asked = [&view] { return SignalWatch::count() > 0 || view.stop_asked(); };
  const auto operator_ = person(options, stop_asked);
  const SignalWatch signals;
  std::filesystem::create_directories(options.out);
  const auto bench = connect(place);
  (void)audit_bench(*bench, campaign, place);  // before a folder is made; its words come with the run
  results::require_room(options.out, bytes_needed(plan, place), bench->files());
  const auto started = std::chrono::time_point_cast<std::chrono::seconds>(bench->clock().epoch_utc());
  const auto folder = results::CampaignFolder::create(
      options.out, fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(std::chrono::system_clock::to_time_t(started))),
      campaign.name, bench->files());
  const auto terminal = display();
  const auto progress = view.beside(*terminal, bench->clock());
  const CampaignResult result = view.tell_the_end(
      [&] { return run_campaign(*bench, campaign, place, folder, *operator_, *progress, stop_asked); });
  summarise(result, folder, options.json);
  return 0;
}

}  // namespace

void add_run(CLI::App& program, int& exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command = program.add_subcommand("run", "run a campaign on a bench and record it");
  command->add_option("campaign", options->campaign, "campaign file")->required();
  command->add_option("--bench", options->bench, "bench file")->required();
  command->add_option("--out", options->out, "where the campaign's folder is made")->capture_default_str();
  command->add_flag("--dry-run", options->dry_run, "check everything, print the plan, touch no device");
  command->add_flag("--yes", options->yes, "take every mounting as done (a simulated bench)");
  command->add_flag("--json", options->json, "the result as one JSON object on stdout");
  live::add_options(*command, options->live);
  command->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace kphi::daq
