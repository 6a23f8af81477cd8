#include "commands/fit.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/csv.hpp"
#include "base/error.hpp"
#include "commands/fit_input.hpp"
#include "commands/report.hpp"
#include "compensation/units.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/report/analysis_json.hpp"
#include "fit/report/family_table.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/signal/blade_pass.hpp"
#include "fit/signal/dynamics.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "results/campaign_folder.hpp"
#include "results/file_layer.hpp"
#include "results/run_reader.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

struct FitRequest {
  std::string path;
  bool anchored = false;
  std::vector<double> points_deg;
  std::string speed_range_rpm;
  std::optional<double> at_speed_rpm;
  std::string out;
  std::string propeller;
  double diameter_in = 0;
  int blades = 0;
  Estimator estimator = Estimator::through_origin;
  Weighting weighting = Weighting::equal;
  Loss loss = Loss::none;
  compensation::OverlapMeasure overlap = compensation::OverlapMeasure::rim_arc;
  std::vector<std::string> uncertainties;
  std::vector<std::string> left_out;
  std::vector<std::string> family;
  bool raw = false;
  bool no_report = false;
  bool json = false;
};

/// "A:B" in RPM; either end may be left out.
SpeedRange parse_speed_range(const std::string& text, SpeedRange range) {
  if (text.empty()) return range;
  const std::size_t colon = text.find(':');
  const auto end = [&](const std::string& part, double& speed) {
    if (part.empty()) return true;
    const auto rpm = parse_number(part);
    if (rpm) speed = from_rpm(*rpm).value();
    return rpm.has_value();
  };
  if (colon == std::string::npos || !end(text.substr(0, colon), range.min_rad_s) ||
      !end(text.substr(colon + 1), range.max_rad_s) || !(range.max_rad_s > range.min_rad_s)) {
    throw ConfigurationError(
        fmt::format("--speed-range-rpm {}: expected A:B with A below B, such as 3000:19100", text));
  }
  return range;
}

IdentificationOptions options_of(const FitRequest& request) {
  IdentificationOptions options;
  options.speed_range = parse_speed_range(request.speed_range_rpm, options.speed_range);
  if (request.at_speed_rpm) options.at_speed_rad_s = from_rpm(*request.at_speed_rpm).value();
  options.line.anchored = request.anchored;
  options.line.points_deg = request.points_deg;
  options.estimator = request.estimator;
  options.weighting = request.weighting;
  options.loss = request.loss;
  for (const std::string& text : request.left_out) options.left_out.push_back(parse_left_out_run(text));
  return options;
}

/// A table of given k is fitted by a line alone: what would be ignored is refused.
void refuse_for_table(const FitRequest& request) {
  const auto refuse = [&](bool given, const char* option) {
    if (given) throw ConfigurationError(fmt::format("{}: a table of given k; {} needs steps", request.path, option));
  };
  refuse(request.estimator != Estimator::through_origin, "--estimator");
  refuse(request.weighting != Weighting::equal, "--weights");
  refuse(request.loss != Loss::none, "--loss");
  refuse(request.at_speed_rpm.has_value(), "--at-speed-rpm");
  refuse(!request.uncertainties.empty(), "--u");
  refuse(!request.left_out.empty(), "--leave-out");
}

Identification identify_input(const FitInput& input, const FitRequest& request) {
  const IdentificationOptions options = options_of(request);
  if (!input.table.empty()) refuse_for_table(request);
  Identification result =
      input.table.empty() ? identify(input.steps, options)
                          : identify_table(input.table, options.line, parse_speed_range(request.speed_range_rpm, {}));
  if (!request.propeller.empty()) result.propeller = request.propeller;
  if (result.propeller.empty()) result.propeller = input.provenance.campaign;
  if (request.diameter_in > 0) result.diameter_in = request.diameter_in;
  if (request.blades > 0) result.blades = request.blades;
  result.overlap = request.overlap;
  return result;
}

/// What the campaign's files know of errors, unless somebody knows better.
AnalysisOptions analysis_options(const FitRequest& request, const FitInput& input,
                                 const Identification& identification) {
  AnalysisOptions options = analysis_options(input, identification);
  for (const std::string& text : request.uncertainties) set_uncertainty(options.bench, text);
  const bool nobody_looks = request.no_report && !request.json;
  if (nobody_looks) options.bootstrap.resamples = 0;
  return options;
}

/// From the first run without occlusion: a whole one lies in memory, 30 MB for the paper's 80 s.
Json raw_json(const FitInput& input) {
  const auto files = results::CampaignFolder::open(input.folder).complete_runs();
  if (files.empty()) throw FitError("no complete run lies in the folder; --raw needs one");
  const std::vector<results::RunRecording> runs{results::read_run(files.front())};
  const auto check = check_by_blade_pass(runs);
  Json json = raw_to_json(identify_dynamics(runs), check);
  const auto& clock = input.provenance.clock;
  if (!check || !clock || !clock->u_gain) return json;
  HypothesisTest agreement = check->against({clock->gain, *clock->u_gain});
  agreement.name = "blade-pass line against the clock gain of the bench file";
  agreement.hypothesis = "both are the same";
  json["blade_pass"]["against_clock_gain"] = to_json(agreement);
  return json;
}

/// This propeller and the others of its family, all fitted alike.
FamilyFindings family_findings(const FitRequest& request, const Identification& identification,
                               const Analysis& analysis) {
  std::vector<FamilyMember> family{{identification, analysis}};
  for (const std::string& path : request.family) {
    const FitInput input = load_input(path);
    FitRequest same = request;
    same.propeller.clear();
    same.diameter_in = same.blades = 0;
    same.left_out.clear();
    Identification other = identify_input(input, same);
    Analysis its = analyse(other, analysis_options(request, input, other));
    family.push_back({std::move(other), std::move(its)});
  }
  return findings_of(family, {});
}

void print_findings(const FitRequest& request, const FitInput& input, const Identification& identification,
                    const Analysis& analysis, const fs::path& file) {
  const Json raw = request.raw ? raw_json(input) : Json();
  std::optional<FamilyFindings> family;
  if (!request.family.empty()) family = family_findings(request, identification, analysis);
  if (!request.json) {
    fmt::print("{}", headline_text(identification));
    if (family) fmt::print("\n{}", family_text(*family));
    if (!raw.is_null()) fmt::print("{}\n", raw.dump(2));
    return;
  }
  Json json = to_json(identification, analysis, file);
  if (family) json.update(to_json(*family));
  if (!raw.is_null()) json["raw"] = raw;
  fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
}

void run_fit(const FitRequest& request) {
  FitInput input = load_input(request.path);
  if (request.raw && !input.campaign)
    throw ConfigurationError(request.path + ": --raw needs the runs of a campaign folder");
  const Identification identification = identify_input(input, request);
  const fs::path file = request.out.empty() ? input.folder / "coefficients.yaml" : fs::path(request.out);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const AnalysisOptions options = analysis_options(request, input, identification);
  if (input.table.empty()) input.provenance.bench = options.bench;
  const Analysis analysis = analyse(identification, options);
  fs::create_directories(folder);
  results::MemoryOnlySync files;  // made again from steps.csv at any time
  results::write_text(file, format_coefficients(identification, input.provenance, &analysis), files);
  print_findings(request, input, identification, analysis, file);
  fmt::print(stderr, "{}coefficients  {}\n", caution_text(identification, analysis), file.string());
  if (!request.no_report) write_report(identification, analysis, input, folder / "report.html");
}

template <class Enum>
std::map<std::string, Enum> names(std::initializer_list<Enum> values) {
  std::map<std::string, Enum> result;
  for (const Enum value : values) result.emplace(name_of(value), value);
  return result;
}

/// One of the names, which the error tells all of. `into` must outlive the command.
template <class Enum>
void add_choice(CLI::App& command, const std::string& option, Enum& into, const std::string& words,
                const std::map<std::string, Enum>& known) {
  const auto take = [&into, option, known](const std::string& word) {
    const auto found = known.find(word);
    if (found == known.end()) {
      std::string all;
      for (const auto& [name, value] : known) all += (all.empty() ? "" : ", ") + name;
      throw CLI::ValidationError(option, fmt::format("\"{}\" is none of {}", word, all));
    }
    into = found->second;
  };
  command.add_option_function<std::string>(option, take, words)->type_name("WORD");
}

std::map<std::string, compensation::OverlapMeasure> overlap_names() {
  std::map<std::string, compensation::OverlapMeasure> result;
  for (const auto& entry : compensation::kOverlapMeasureNames) result.emplace(entry.name, entry.measure);
  return result;
}

}  // namespace

void add_fit(CLI::App& app, int&) {
  auto request = std::make_shared<FitRequest>();
  CLI::App* command = app.add_subcommand("fit", "steps → k of each occlusion → the line k(φ), with a report");
  command->add_option("INPUT", request->path, "campaign folder, steps.csv, or K.csv with phi_deg,k[,u_k]")
      ->required()
      ->check(CLI::ExistingPath);
  command->add_flag("--anchored", request->anchored, "the line starts at K_T (default: free, through the occlusions)");
  command->add_option("--points", request->points_deg, "angles in degrees that carry the line (default: all above 0)")
      ->delimiter(',');
  command->add_option("--speed-range-rpm", request->speed_range_rpm,
                      "A:B, speeds to fit (default 3000: and up; below, thrust is under the load cell's noise)");
  command->add_option("--at-speed-rpm", request->at_speed_rpm,
                      "speed of \"k at speed\" (default: the highest that every occlusion reached)");
  add_choice(*command, "--estimator", request->estimator,
             "which k: origin, offset, polynomial, speed (default: origin)",
             names({Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed}));
  add_choice(*command, "--weights", request->weighting, "equal, thrust, effective-variance (default: equal)",
             names({Weighting::equal, Weighting::thrust, Weighting::effective_variance}));
  add_choice(*command, "--loss", request->loss, "none, huber, cauchy, tukey (default: none)",
             names({Loss::none, Loss::huber, Loss::cauchy, Loss::tukey}));
  add_choice(*command, "--overlap", request->overlap,
             "how φ is measured in flight: rim_arc, area_share, load_share (default: rim_arc); who flies the file "
             "otherwise is refused",
             overlap_names());
  command
      ->add_option("--u", request->uncertainties,
                   "NAME=VALUE, standard uncertainty of calibration, cross-axis, clock, density (relative) or "
                   "alignment-deg; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--leave-out", request->left_out,
                   "PHI:REPETITION:CAUSE, a run that is known to be spoiled; listed in the report, may be repeated")
      ->allow_extra_args(false);
  command->add_option("--family", request->family, "other propellers, fitted alike: the paper's claims as a table")
      ->check(CLI::ExistingPath);
  command->add_flag("--raw", request->raw, "time constants, and the motor's clock by blade pass, from the first run");
  command->add_option("--out", request->out, "coefficient file; report and figures go beside it");
  command->add_option("--propeller", request->propeller, "id of the propeller (default: from the steps)");
  command->add_option("--diameter-in", request->diameter_in, "diameter in inches (default: from the steps)");
  command->add_option("--blades", request->blades, "number of blades (default: from the steps)");
  command->add_flag("--no-report", request->no_report, "coefficients only");
  command->add_flag("--json", request->json, "the result as JSON on stdout");
  command->footer("kphi fit results/<folder>\nkphi fit K.csv --anchored --points 45,90 --out k.yaml");
  command->callback([request] { run_fit(*request); });
}

}  // namespace kphi::fit
