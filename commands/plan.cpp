// `kphi plan`: what a campaign will tell before it is run, and the cheapest ones that tell what is wanted.
#include <algorithm>
#include <vector>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "daq/campaign/dry_run.hpp"
#include "fit/plan/choices.hpp"
#include "fit/propellers/history.hpp"
#include "profiles/campaign_text.hpp"

namespace kphi::commands {
namespace {

using namespace fit;

struct PlanRequest {
  std::string campaign, bench, out;
  std::vector<std::string> pilots, wishes, stated, uncertainties;
  double minutes_per_mounting = 2;
  std::size_t choose = 1;
  bool json = false;
};

/// What the pilots say of the stand, its errors and the curve.
void take_pilots(const PlanRequest& request, PlanQuestion& question) {
  std::vector<FittedFolder> folders;
  for (const std::string& path : request.pilots) folders.push_back(fitted_again(path));
  std::vector<PilotCampaign> pilots;
  std::vector<Fitted> fitted;
  std::vector<std::string> when;
  for (std::size_t i = 0; i < folders.size(); ++i) {
    pilots.push_back({folders[i].fitted, folders[i].input.measured_by ? folders[i].input.measured_by->zero.value() : 1,
                      folders[i].input.mounted_once});
    fitted.push_back(folders[i].fitted);
    when.push_back(folders[i].input.provenance.measured_utc);
  }
  if (!of_one_propeller(fitted)) throw ConfigurationError("the pilots are of several propellers; name those of one");
  question.noise = noise_of(pilots);
  if (fitted.size() >= kLeastHistory)
    question.noise.campaigns = history_of(fitted, request.pilots, when).charts.front().between;
  question.uncertainty = folders.back().input.provenance.bench.value_or(BenchUncertainty{});
  if (!question.noise.mounting) question.noise.mounting = question.uncertainty.mounting;
  question.curve = folders.back().fitted.identification.options.curve;
  question.curve.points_deg.clear();
}

ExitCode run_plan(const PlanRequest& request) {
  PlanQuestion question;
  question.campaign = profiles::load_campaign(request.campaign);
  if (!request.bench.empty()) question.bench = profiles::load_bench(request.bench);
  question.bytes = [&](const profiles::Plan& plan) { return daq::bytes_needed(plan, question.bench); };
  question.minutes_per_mounting = request.minutes_per_mounting;
  if (request.pilots.empty() && request.stated.empty())
    throw ConfigurationError(
        "kphi plan needs to know the stand: run one campaign and name it with --pilot DIR, or state its noise with "
        "--stand NAME=VALUE");
  if (!request.pilots.empty()) take_pilots(request, question);
  for (const std::string& text : request.stated) state(question.noise, text);
  for (const std::string& text : request.uncertainties) set_uncertainty(question.uncertainty, text);
  if (question.uncertainty.mounting) question.noise.mounting = question.uncertainty.mounting;
  for (const std::string& text : request.wishes) question.wishes.push_back(parse_wish(text));
  const PlanAnswer found = answer(question);
  fmt::print("{}", request.json ? answer_json(question, found) : answer_text(question, found));
  if (!found.unreachable.empty()) return ExitCode::data_rejected;
  if (request.out.empty()) return ExitCode::ok;
  if (found.choices.size() < request.choose)
    throw ConfigurationError(
        fmt::format("--choose {}: only {} campaigns were found", request.choose, found.choices.size()));
  const profiles::Campaign& chosen = found.choices[request.choose - 1].campaign;
  write_output(request.out, profiles::changed_text(question.campaign, chosen));
  fmt::print(stderr, "campaign      {}\n", request.out);
  return ExitCode::ok;
}

}  // namespace

void add_plan(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<PlanRequest>(
      program, exit_code, "plan", "tell how certain a campaign will be, and the cheapest one that tells what is wanted",
      "kphi plan campaign.yaml --pilot results/<folder> --want \"slope 1 %\" --want \"k(135) 0.5 %\" --out short.yaml",
      run_plan);
  add_argument(command, "CAMPAIGN", request.campaign, "campaign file; its occlusions are the plates that there are")
      ->check(kExistingFile);
  add_value(command, "--pilot", "DIR", request.pilots,
            "fitted campaign of this stand and propeller; may be repeated, from four on with what changes between days")
      ->allow_extra_args(false);
  add_value(command, "--want", "\"WHAT PERCENT %\"", request.wishes,
            "half of the 95 % interval of K_T, slope, k(DEG) or k_i(DEG); may be repeated")
      ->allow_extra_args(false);
  add_value(command, "--out", "FILE", request.out,
            "write the chosen campaign to a new file: this one with its values replaced");
  add_value(command, "--choose", "N", request.choose, "which of the choices (default: 1, the cheapest)")
      ->check(CLI::PositiveNumber.description(""));
  command.add_flag("--json", request.json, "print everything as JSON");
  begin_group(command, "What is known of the stand");
  add_value(command, "--stand", "NAME=VALUE", request.stated,
            "what is known of the stand, instead of the pilot's: noise-n, memory-s, zero-n, runs, mounting, …")
      ->allow_extra_args(false);
  add_value(command, "--u", "NAME=VALUE", request.uncertainties,
            "standard uncertainty, as of kphi fit; may be repeated")
      ->allow_extra_args(false);
  add_value(command, "--bench", "FILE", request.bench, "bench file, for its sample rate (default: the usual one)")
      ->check(kExistingFile);
  add_value(command, "--minutes-per-mounting", "MIN", request.minutes_per_mounting,
            "of a person at the stand (default: 2)")
      ->check(CLI::NonNegativeNumber.description(""));
}

}  // namespace kphi::commands
