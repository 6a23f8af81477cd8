#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "base/csv.hpp"
#include "base/number.hpp"
#include "commands/commands.hpp"
#include "commands/fit_flight.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "compensation/units.hpp"
#include "fit/coefficients/coefficients.hpp"
#include "fit/coefficients/error_in_flight.hpp"
#include "fit/model/table_line.hpp"
#include "fit/plan/outlook.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/propellers/history.hpp"
#include "fit/report/figures.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/report/history_section.hpp"
#include "fit/report/raw_samples.hpp"
#include "fit/report/report.hpp"
#include "fit/signal/blade_pass.hpp"
#include "fit/signal/dynamics.hpp"
#include "fit/uncertainty/analysis.hpp"
#include "profiles/stand_drawing.hpp"
#include "profiles/vehicle.hpp"
#include "profiles/vehicle_drawing.hpp"
#include "results/campaign_folder.hpp"
#include "results/checksums.hpp"
#include "results/run_reader.hpp"

namespace kphi::commands {
namespace {

using namespace fit;

namespace fs = std::filesystem;

/// What a report shows beside the fit, on request.
struct PageRequest {
  bool claims = false;
  std::string earlier;
};

/// The campaign that is to be drawn as a ghost. Throws ConfigurationError if it is of another propeller.
std::optional<FittedFolder> earlier_of(const PageRequest& page, const Fitted& fitted) {
  if (page.earlier.empty()) return std::nullopt;
  FittedFolder earlier = fitted_again(page.earlier);
  const std::string &ours = fitted.identification.propeller, &theirs = earlier.fitted.identification.propeller;
  if (ours != theirs)
    throw ConfigurationError(fmt::format("--earlier {}: of propeller {}, not of {}; name a campaign of the same",
                                         page.earlier, theirs, ours));
  return earlier;
}

/// Fills the runs of `input` from their files and draws.
Figures draw_all(const Fitted& fitted, FitInput& input, const fs::path& figures, const PageRequest& page = {}) {
  const auto earlier = earlier_of(page, fitted);
  const Identification& identification = fitted.identification;
  RawSamples raw;
  if (input.campaign) {
    raw = read_raw_samples(identification, std::move(input.provenance.runs), input.folder);
    input.provenance.runs = std::move(raw.runs);
  }
  if (raw.shares.empty()) raw.shares = shares_of_steps(identification);
  DrawnBeside beside{raw.settling ? &*raw.settling : nullptr, raw.whole ? &*raw.whole : nullptr};
  beside.paper = page.claims;
  if (earlier) {
    const Provenance& from = earlier->input.provenance;
    beside.earlier = &earlier->fitted;
    beside.earlier_words =
        fmt::format("{} ({}, {})", (fs::path(page.earlier) / ".").lexically_normal().parent_path().filename().string(),
                    name_of(from.origin), from.measured_utc.substr(0, 10));
  }
  Figures drawn = draw_figures(fitted, raw.shares, figures, "gnuplot", beside);
  if (!drawn.skipped.empty()) fmt::print(stderr, "kphi: figures skipped: {}\n", drawn.skipped);
  return drawn;
}

/// Enters what was written beside a campaign into its SHA256SUMS.
void record(const FitInput& input, const fs::path& folder, std::vector<fs::path> written) {
  std::error_code none;
  if (!input.campaign || !fs::equivalent(input.folder, folder, none)) return;
  for (const auto& figure : fs::directory_iterator(folder / "figures", none)) written.push_back(figure.path());
  results::record_sums(input.folder, written);
}

void write_page(const fs::path& page, const std::string& html) {
  if (page.has_parent_path()) fs::create_directories(page.parent_path());
  write_output(page, html);
  fmt::print(stderr, "report        {}\n", page.string());
}

/// Of a campaign's stand; empty without one.
std::string drawing_of(const FitInput& input) {
  if (!input.measured_by) return {};
  return profiles::draw_stand(profiles::sketch_of(input.measured_by->propeller, input.bench.iq.spin),
                              input.measured_by->occlusions_deg);
}

/// The number of the verdict where a vehicle flies, in words, and the vehicle as SVG; empty without one.
struct OnVehicle {
  std::string verdict, drawing;
};

/// `apart`: how the names of page and figures begin, apart from those of the campaign in the same folder.
void write_report(const Fitted& fitted, FitInput& input, const fs::path& page, const std::string& apart = {},
                  const OnVehicle& there = {}, const PageRequest& asked = {}) {
  const Figures figures = draw_all(fitted, input, page.parent_path() / (apart + "figures"), asked);
  write_page(page, format_report(fitted, {input.provenance, figures, drawing_of(input), there.verdict, there.drawing,
                                          asked.claims}));
}

struct FitRequest {
  std::string path, k_unit;
  IdentificationOptions options;  ///< of the fit; the rest of the request completes them
  std::string speed_range_rpm;
  std::optional<double> at_speed_rpm;
  std::string out;
  std::vector<std::string> uncertainties;
  std::vector<std::string> left_out;
  std::vector<std::string> family;
  bool raw = false;
  bool no_report = false;
  std::optional<double> fly_within_percent;
  bool accept = false;
  bool json = false;
  std::string vehicle;
  PageRequest page;
  std::string layout, shape, bench;  ///< of a flight
  std::optional<double> mass_kg;
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
  IdentificationOptions options = request.options;
  options.speed_range = parse_speed_range(request.speed_range_rpm, options.speed_range);
  if (request.at_speed_rpm) options.at_speed_rad_s = from_rpm(*request.at_speed_rpm).value();
  for (const std::string& text : request.left_out) options.left_out.push_back(parse_left_out_run(text));
  BenchUncertainty given;
  for (const std::string& text : request.uncertainties) set_uncertainty(given, text);
  options.mounting = given.mounting;
  return options;
}

/// A table of given k is fitted by a curve alone: what would be ignored is refused.
void refuse_for_table(const FitRequest& request) {
  const auto refuse = [&](bool given, const char* option) {
    if (given) throw ConfigurationError(fmt::format("{}: a table of given k; {} needs steps", request.path, option));
  };
  refuse(request.options.estimator != Estimator::through_origin, "--estimator");
  refuse(request.options.weighting != Weighting::equal, "--weights");
  refuse(request.options.loss != Loss::none, "--loss");
  refuse(request.at_speed_rpm.has_value(), "--at-speed-rpm");
  refuse(!request.uncertainties.empty(), "--u");
  refuse(!request.left_out.empty(), "--leave-out");
}

Identification identify_input(const FitInput& input, const FitRequest& request) {
  IdentificationOptions options = options_of(request);
  options.mounted_once = input.mounted_once;
  if (input.table.empty()) {
    Identification result = identify(input.steps, options);
    if (result.propeller.empty()) result.propeller = input.provenance.campaign;
    return result;
  }
  refuse_for_table(request);
  options.speed_range = parse_speed_range(request.speed_range_rpm, {});
  if (options.propeller.empty()) options.propeller = input.provenance.campaign;
  return identify_table(input.table, options);
}

/// The limits of the verdict as asked for.
ReadinessLimits limits_of(const FitRequest& request) {
  ReadinessLimits limits;
  const auto& percent = request.fly_within_percent;
  if (!percent) return limits;
  if (!(*percent > 0 && *percent <= 100))
    throw ConfigurationError(
        fmt::format("--fly-within {}: expected a share of the thrust above 0, in percent", *percent));
  limits.fit_to_fly = *percent / 100;
  limits.with_care = std::max(limits.with_care, limits.fit_to_fly);
  return limits;
}

/// What the campaign's files know of errors; --u overrides it.
AnalysisOptions analysis_options(const FitRequest& request, const FitInput& input,
                                 const Identification& identification) {
  AnalysisOptions options = commands::analysis_options(input, identification);
  for (const std::string& text : request.uncertainties) set_uncertainty(options.bench, text);
  options.limits = limits_of(request);
  return options;
}

/// From the first run without occlusion: a whole one lies in memory, 30 MB for the paper's 80 s.
Json raw_json(const FitInput& input) {
  const auto files = results::CampaignFolder::open(input.folder).complete_runs();
  if (files.empty()) throw FitError("no complete run in the folder; --raw needs one");
  const std::vector<results::RunRecording> runs{results::read_run(files.front())};
  const auto check = check_by_blade_pass(runs);
  const auto dynamics = identify_dynamics(runs);
  Json json{{"dynamics", dynamics ? Json(*dynamics) : Json()}, {"blade_pass", check ? Json(*check) : Json()}};
  const auto& clock = input.provenance.clock;
  if (!check || !clock || !clock->u_gain) return json;
  HypothesisTest agreement = check->against({clock->gain, *clock->u_gain});
  agreement.name = "blade-pass line against the clock gain of the bench file";
  agreement.hypothesis = "both are the same";
  json["blade_pass"]["against_clock_gain"] = agreement;
  return json;
}

/// This propeller and the others of its family, all fitted alike.
FamilyFindings family_findings(const FitRequest& request, const Fitted& fitted) {
  std::vector<Fitted> family{fitted};
  for (const std::string& path : request.family) {
    const FitInput input = load_input(path, request.k_unit);
    FitRequest same = request;
    same.options.propeller.clear();
    same.options.diameter_in = same.options.blades = 0;
    same.left_out.clear();
    Identification other = identify_input(input, same);
    Analysis its = analyse(other, analysis_options(request, input, other));
    family.push_back({std::move(other), std::move(its)});
  }
  return findings_of(family, {});
}

std::optional<OneMore> one_more(const FitInput& input, const Fitted& fitted) {
  if (!input.measured_by) return std::nullopt;
  return one_more_repetition(fitted, *input.measured_by, input.bench,
                             input.provenance.bench.value_or(BenchUncertainty{}));
}

OnVehicle on_vehicle(const FitRequest& request, const std::string& coefficients, const fs::path& file) {
  if (request.vehicle.empty()) return {};
  const profiles::Vehicle vehicle = profiles::load_vehicle(request.vehicle);
  OnVehicle there{"", profiles::draw_shapes(vehicle)};
  if (const auto error = error_in_flight(compensation::parse_coefficients(coefficients, file.string()), vehicle))
    there.verdict = words(*error, vehicle);
  return there;
}

void print_findings(const FitRequest& request, const FitInput& input, const Fitted& fitted, const fs::path& file) {
  const Json raw = request.raw ? raw_json(input) : Json();
  std::optional<FamilyFindings> family;
  if (!request.family.empty()) family = family_findings(request, fitted);
  if (!request.json) {
    fmt::print("{}", headline_text(fitted));
    if (const auto more = one_more(input, fitted)) fmt::print("{}\n", to_words(*more));
    if (family) fmt::print("\n{}", family_text(*family));
    if (!raw.is_null()) fmt::print("{}\n", raw.dump(2));
    return;
  }
  Json json = fit_json(fitted.identification, fitted.analysis, file);
  if (family) json.update(Json(*family));
  if (const auto more = one_more(input, fitted)) json["one_more_repetition"] = to_json(*more);
  if (!raw.is_null()) json["raw"] = raw;
  print_json(json);
}

std::string text_of(const char* name, const Estimate& estimate, const char* per) {
  return fmt::format("{:<10} {} N/(rad/s)^2{}\n", name, with_error(estimate.value, expanded(estimate)), per);
}

Json json_of(const Estimate& estimate) {
  return {
      {"value", estimate.value}, {"u", estimate.u}, {"freedom", estimate.freedom}, {"expanded_95", expanded(estimate)}};
}

/// Of a table that cannot fly: the line and its scatter, on screen alone.
ExitCode run_table_line(const FitRequest& request, const FitInput& input, const std::string& obstacle) {
  refuse_for_table(request);
  if (request.options.curve.loss != Loss::none)
    throw ConfigurationError(request.path + ": " + obstacle + "; such a table takes no --curve-loss");
  const TableLine line = fit_table_line(input.table, request.options.curve.anchored);
  const char* verdict = words(Readiness::not_yet);
  if (request.json) {
    print_json({{"coefficients", nullptr},
                {"verdict", name_of(Readiness::not_yet)},
                {"doubts", Json::array({"the table cannot fly: " + obstacle})},
                {"k_unit", "N/(rad/s)^2"},
                {"curve",
                 {{"form", "line"},
                  {"anchored", line.anchored},
                  {"intercept", json_of(line.intercept)},
                  {"slope_per_deg", json_of(line.slope_per_deg)}}},
                {"points", line.points},
                {"weighted", line.weighted},
                {"scatter", line.scatter}});
  } else {
    fmt::print("{:<10} {}\n{:<10} the table cannot fly: {}\n{}{}", "verdict", verdict, "", obstacle,
               text_of("intercept", line.intercept, ""), text_of("slope", line.slope_per_deg, "/deg"));
    fmt::print("± is 95 % by the scatter of {} points about the line{}\n", line.points,
               line.weighted ? ", weighted by their u" : "; no u of k was given");
  }
  fmt::print(stderr, "kphi fit: {}: {}; no coefficient file was written\n", request.path, obstacle);
  return ExitCode::data_rejected;
}

ExitCode refused_or_ok(const FitRequest& request, const Fitted& fitted) {
  if (fitted.analysis.flight.readiness() != Readiness::not_yet || request.accept) return ExitCode::ok;
  fmt::print(stderr, "kphi fit: do not fly yet (see above); --accept takes the result all the same\n");
  return ExitCode::data_rejected;
}

ExitCode run_flight(const FitRequest& request) {
  const auto refuse = [&](bool given, const char* option) {
    if (given) throw ConfigurationError(fmt::format("{}: a flight log; {} is for a bench", request.path, option));
  };
  const IdentificationOptions& options = request.options;
  refuse(options.estimator != Estimator::through_origin, "--estimator");
  refuse(options.weighting != Weighting::equal, "--weights");
  refuse(options.loss != Loss::none || options.curve.loss != Loss::none, "--loss or --curve-loss");
  refuse(!options.curve.points_deg.empty(), "--points");
  refuse(request.at_speed_rpm || !request.speed_range_rpm.empty(), "--at-speed-rpm or --speed-range-rpm");
  refuse(!request.left_out.empty() || !request.family.empty() || request.raw, "--leave-out, --family or --raw");
  return fit_flight_log({.path = request.path,
                         .vehicle = request.vehicle,
                         .layout = request.layout,
                         .shape = request.shape,
                         .out = request.out,
                         .propeller = options.propeller,
                         .bench = request.bench,
                         .blades = options.blades,
                         .form = options.curve.form,
                         .mass_kg = request.mass_kg,
                         .uncertainties = request.uncertainties,
                         .limits = limits_of(request),
                         .no_report = request.no_report,
                         .accept = request.accept,
                         .json = request.json});
}

ExitCode run_fit(const FitRequest& request) {
  if (is_flight_log(request.path, request.layout)) return run_flight(request);
  if (request.mass_kg || !request.shape.empty() || !request.bench.empty())
    throw ConfigurationError(request.path + ": not a flight log; --mass, --shape and --bench are for one");
  FitInput input = load_input(request.path, request.k_unit);
  if (!input.table.empty())
    if (const std::string obstacle = obstacle_to_flight(input.table); !obstacle.empty())
      return run_table_line(request, input, obstacle);
  if (request.raw && !input.campaign)
    throw ConfigurationError(request.path + ": --raw needs the runs of a campaign folder");
  Fitted fitted{identify_input(input, request), {}};
  const Identification& identification = fitted.identification;
  if (const double K_T = identification.thrust_coefficient().value; !(K_T > 0))
    throw DataRejected(
        fmt::format("{}: K_T is {:.3e} N/(rad/s)^2 and must be positive: thrust does not rise with speed; mirror "
                    "thrust_axis in the "
                    "bench file if its sign is reversed",
                    request.path, K_T));
  // A table that lies in a campaign's folder is not the campaign.
  const bool is_apart = !input.campaign && fs::exists(input.folder / "journal.jsonl");
  const std::string apart = is_apart ? fs::path(request.path).stem().string() + "_" : "";
  const fs::path file = request.out.empty() ? input.folder / (apart + "coefficients.yaml") : fs::path(request.out);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const AnalysisOptions options = analysis_options(request, input, identification);
  if (input.table.empty()) input.provenance.bench = options.bench;
  if (options.bench.calibration_note.empty()) input.provenance.cell_weighed.clear();
  fitted.analysis = analyse(identification, options);
  fs::create_directories(folder);
  const std::string text = format_coefficients(fitted, input.provenance);
  write_output(file, text);
  print_findings(request, input, fitted, file);
  const OnVehicle there = on_vehicle(request, text, file);
  if (!there.verdict.empty()) fmt::print(stderr, "in flight     {}\n", there.verdict);
  if (input.provenance.origin != Origin::measured)
    fmt::print(stderr, "origin        {}\n",
               input.provenance.origin == Origin::simulated ? "SIMULATED, no propeller turned" : "unknown");
  if (!input.provenance.cell_weighed.empty())
    fmt::print(stderr, "calibration   {}; in the ±, not corrected\n", input.provenance.cell_weighed);
  fmt::print(stderr, "{}coefficients  {}\n", caution_text(identification, fitted.analysis), file.string());
  std::vector<fs::path> written{file};
  if (!request.no_report) {
    write_report(fitted, input, folder / (apart + "report.html"), apart, there, request.page);
    written.push_back(folder / (apart + "report.html"));
  }
  record(input, folder, written);
  return refused_or_ok(request, fitted);
}

/// An option that takes the name of one of `values`; `into` must outlive the command.
template <class Enum>
void add_choice(CLI::App& command, const std::string& option, Enum& into, const std::string& what,
                std::initializer_list<Enum> values) {
  std::map<std::string, Enum> known;
  for (const Enum value : values) known.emplace(name_of(value), value);
  std::vector<std::string> names;
  for (const auto& [name, value] : known) names.push_back(name);
  const std::string all = fmt::format("{}", fmt::join(names, ", "));
  const auto take = [&into, option, known, all](const std::string& word) {
    const auto found = known.find(word);
    if (found == known.end()) throw CLI::ValidationError(option, fmt::format("\"{}\" is not one of {}", word, all));
    into = found->second;
  };
  command.add_option_function<std::string>(option, take, fmt::format("{} (default: {})", what, name_of(into)))
      ->type_name(fmt::format("{{{}}}", fmt::join(names, ",")));
}

struct ReportRequest {
  std::vector<std::string> folders;
  std::string out;
  PageRequest page;
};

void add_page_options(CLI::App& command, PageRequest& page) {
  command.add_flag("--claims", page.claims, "beside ours what the paper says of this propeller");
  add_value(command, "--earlier", "DIR", page.earlier, "draw k of an earlier campaign of this propeller behind ours")
      ->check(kExistingFolder);
}

/// One page of several campaigns; their figures go beside it, a folder each.
ExitCode report_several(const ReportRequest& request) {
  if (!request.page.earlier.empty()) throw ConfigurationError("--earlier is for the report of one campaign");
  const fs::path page = request.out.empty() ? fs::path("report.html") : fs::path(request.out);
  const fs::path figures = page.parent_path() / "figures";
  std::vector<Fitted> family;
  std::vector<Chapter> chapters;
  for (const std::string& path : request.folders) {
    auto [input, fitted] = fitted_again(path);
    const Figures drawn = draw_all(fitted, input, figures / fmt::format("{}", chapters.size() + 1));
    family.push_back(std::move(fitted));
    chapters.push_back({std::move(input.provenance), drawn});
  }
  const auto alone = std::ranges::count_if(family, [](const Fitted& one) { return one.identification.alone(); });
  if (std::cmp_equal(alone, family.size())) {
    write_page(page, format_reports(family, chapters, {}, nullptr));
    return ExitCode::ok;
  }
  if (alone > 0)
    throw ConfigurationError("logs without occlusions and campaigns do not fit on one page; report them apart");
  std::optional<History> history;
  if (family.size() >= kLeastHistory && of_one_propeller(family)) {
    std::vector<std::string> when;
    for (const Chapter& chapter : chapters) when.push_back(chapter.provenance.measured_utc);
    history = history_of(family, request.folders, when);
  }
  const Figure together = history ? history_figure(*history) : family_figure(family);
  write_page(page, format_reports(family, chapters, draw({together}, figures), history ? &*history : nullptr));
  return ExitCode::ok;
}

ExitCode run_report(const ReportRequest& request) {
  if (request.folders.size() > 1) return report_several(request);
  const std::string& path = request.folders.front();
  auto [input, fitted] = fitted_again(path);
  const fs::path page = request.out.empty() ? fs::path(path) / "report.html" : fs::path(request.out);
  write_report(fitted, input, page, {}, {}, request.page);
  if (request.out.empty()) record(input, path, {page});
  return ExitCode::ok;
}

}  // namespace

void add_fit(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<FitRequest>(
      program, exit_code, "fit", "fit k to the steps of each occlusion, then the curve k(φ); write a report",
      "kphi fit results/<folder>\nkphi fit K.csv --anchored --points 45,90 --out k.yaml\n"
      "kphi fit flight.ulg --vehicle vehicle.yaml --mass 0.612",
      run_fit);
  add_argument(
      command, "INPUT", request.path,
      "campaign folder, steps.csv, K.csv with phi_deg and k_n_s2_per_rad2 or k_n_per_rpm2[, u_k_…], or a flight log "
      "(PX4 ULog, Crazyflie card log, any table with --layout)")
      ->check(kExistingPath);
  add_value(command, "--out", "FILE", request.out, "coefficient file; report and figures go beside it");
  add_value(
      command, "--vehicle", "FILE", request.vehicle,
      "vehicle file: also say by how much the thrust may be wrong for its φ and speeds, and draw it in the report")
      ->check(kExistingFile);
  command.add_option("--fly-within", request.fly_within_percent,
                     "error of the thrust, percent, up to which the result is fit to fly (default 3; with care to 10)");
  add_value(command, "--leave-out", "PHI:REPETITION:CAUSE", request.left_out,
            "leave out a run for a known cause, which the report names; may be repeated")
      ->allow_extra_args(false);
  command.add_flag("--accept", request.accept, "exit with 0 also if the verdict is: do not fly yet");
  command.add_flag("--json", request.json, "print the result as JSON");
  begin_group(command, "The report");
  command.add_flag("--no-report", request.no_report, "write coefficients only");
  add_page_options(command, request.page);
  begin_group(command, "The curve k(φ)");
  add_choice(command, "--form", request.options.curve.form,
             "form of k(φ): a line, or a table from K_T through every occlusion", {CurveForm::line, CurveForm::table});
  command.add_flag("--anchored", request.options.curve.anchored,
                   "start the line at K_T (default: free, through the occlusions)");
  add_value(command, "--points", "DEG,DEG,…", request.options.curve.points_deg,
            "angles that carry the curve, in degrees (default: all above 0)")
      ->delimiter(',');
  using compensation::OverlapMeasure;
  add_choice(command, "--overlap", request.options.overlap,
             "how φ is measured in flight, to be the same in the vehicle file",
             {OverlapMeasure::rim_arc, OverlapMeasure::area_share, OverlapMeasure::load_share});
  begin_group(command, "Estimators");
  add_value(command, "--speed-range-rpm", "A:B", request.speed_range_rpm,
            "speeds to fit (default 3000: and up; below, noise of the load cell hides the thrust)");
  command.add_option("--at-speed-rpm", request.at_speed_rpm,
                     "speed of \"k at speed\" (default: the highest one that every occlusion reached)");
  add_choice(command, "--estimator", request.options.estimator, "how k is estimated",
             {Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed});
  add_choice(command, "--weights", request.options.weighting, "how steps are weighted",
             {Weighting::equal, Weighting::thrust, Weighting::effective_variance});
  add_choice(command, "--loss", request.options.loss, "robust loss",
             {Loss::none, Loss::huber, Loss::cauchy, Loss::tukey});
  add_choice(command, "--curve-loss", request.options.curve.loss,
             "robust loss of the line, scaled by the error of each k",
             {Loss::none, Loss::huber, Loss::cauchy, Loss::tukey});
  begin_group(command, "What the input does not tell");
  add_value(command, "--k-unit", "UNIT", request.k_unit, "unit of a column named k: N/(rad/s)^2 or N/RPM^2")
      ->check(CLI::IsMember({"N/(rad/s)^2", "N/RPM^2"}));
  add_value(
      command, "--u", "NAME=VALUE", request.uncertainties,
      "standard uncertainty of calibration, cross-axis, clock, density, mounting (all relative) or alignment-deg; may "
      "be repeated")
      ->allow_extra_args(false);
  add_value(command, "--propeller", "ID", request.options.propeller, "id of the propeller (default: from the steps)");
  command.add_option("--diameter-in", request.options.diameter_in, "diameter in inches (default: from the steps)");
  command.add_option("--blades", request.options.blades, "number of blades (default: from the steps)");
  begin_group(command, "A flight");
  command.add_option("--mass", request.mass_kg, "the vehicle with its battery, kg (default: the vehicle file's)")
      ->type_name("KG")
      ->check(CLI::PositiveNumber);
  add_value(command, "--layout", "FILE", request.layout, "which series of the log is which channel")
      ->check(CLI::ExistingFile);
  add_value(command, "--shape", "NAME", request.shape, "without arm angles: the shape it flew in");
  add_value(command, "--bench", "RESULT", request.bench, "coefficients to draw beside its own")->check(kExistingPath);
  begin_group(command, "Developers");
  add_value(command, "--family", "PATH", request.family,
            "fit other propellers the same way and check the paper's claims")
      ->check(kExistingPath);
  command.add_flag("--raw", request.raw,
                   "add time constants, and a check of the motor's clock by blade pass, from the first run");
}

void add_report(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<ReportRequest>(
      program, exit_code, "report", "draw report.html of fitted campaigns again, several on one page",
      "kphi report results/<folder>\nkphi report results/<5x2> results/<5x3> results/<6x2> results/<6x3> --out "
      "four.html",
      run_report);
  add_argument(command, "DIR", request.folders, "campaign folders with steps.csv and coefficients.yaml")
      ->check(kExistingFolder);
  add_value(command, "--out", "FILE", request.out,
            "page (default: report.html in DIR; for several DIRs: in the working folder)");
  add_page_options(command, request.page);
}

}  // namespace kphi::commands
