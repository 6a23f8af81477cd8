#include "fit/commands.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "compensation/file/coefficient_file.hpp"
#include "fit/analysis.hpp"
#include "fit/analysis_json.hpp"
#include "fit/blade_pass.hpp"
#include "fit/coefficients.hpp"
#include "fit/csv.hpp"
#include "fit/detail_figures.hpp"
#include "fit/dynamics.hpp"
#include "fit/fit_error.hpp"
#include "fit/k_table.hpp"
#include "fit/on_run.hpp"
#include "fit/raw_samples.hpp"
#include "fit/report.hpp"
#include "fit/uncertainty_block.hpp"
#include "profiles/bench.hpp"
#include "profiles/campaign.hpp"
#include "profiles/configuration_error.hpp"
#include "results/campaign_folder.hpp"
#include "results/journal.hpp"
#include "results/run_reader.hpp"
#include "results/sha256.hpp"
#include "results/steps_csv.hpp"
#include "results/version.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

/// What is fitted, and what is known about where it comes from.
struct Input {
  std::vector<results::StepMean> steps;
  std::vector<LinePoint> table;  ///< instead of steps
  Provenance provenance;
  fs::path folder;        ///< where the outputs go
  bool campaign = false;  ///< `folder` is a campaign folder
};

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
  std::vector<std::string> uncertainties;
  std::vector<std::string> family;
  bool raw = false;
  bool no_report = false;
  bool json = false;
};

void take_rejected(const results::CampaignFolder& folder, Provenance& provenance) {
  const auto text = [](const nlohmann::json& data, const char* key) {
    return data.contains(key) && data[key].is_string() ? data[key].get<std::string>() : std::string("unknown");
  };
  for (const results::JournalEntry& entry : results::read_journal(folder.journal()).entries)
    if (entry.event == results::kRunAborted)
      provenance.rejected.push_back({text(entry.data, "run"), entry.utc, text(entry.data, "reason")});
}

/// Accepted runs with the checksums the journal holds, and when the last of them ended; without a journal the files
/// as they lie there.
void take_runs(const results::CampaignFolder& folder, Provenance& provenance) {
  if (fs::exists(folder.journal())) {
    for (const results::JournalEntry& entry : results::read_journal(folder.journal()).entries) {
      if (entry.event != results::kRunAccepted || !entry.data.contains("file") || !entry.data.contains("sha256"))
        continue;
      provenance.runs.push_back({entry.data["file"], entry.data["sha256"], "", std::nullopt});
      provenance.measured_utc = entry.utc;
    }
    take_rejected(folder, provenance);
    return;
  }
  for (const fs::path& run : folder.complete_runs())
    provenance.runs.push_back(
        {fs::relative(run, folder.path()).string(), results::sha256_of_file(run), "", std::nullopt});
}

MotorClock clock_of(const fs::path& bench_file) {
  const auto gain = profiles::load_bench(bench_file.string()).iq.clock_gain;
  return gain ? MotorClock{gain->factor, gain->u_factor} : MotorClock{};
}

Input campaign_input(const fs::path& path) {
  const auto folder = results::CampaignFolder::open(path);
  if (!fs::exists(folder.steps())) {
    throw ConfigurationError(
        fmt::format("{}: no steps.csv; `kphi replay {}` makes it from the runs", path.string(), path.string()));
  }
  Input input;
  input.folder = path;
  input.campaign = true;
  input.steps = results::read_steps(folder.steps());
  input.provenance.source = "steps.csv of the campaign folder";
  take_runs(folder, input.provenance);
  if (fs::exists(folder.bench_file())) input.provenance.clock = clock_of(folder.bench_file());
  if (fs::exists(folder.campaign_file())) {
    const profiles::Campaign campaign = profiles::load_campaign(folder.campaign_file().string());
    input.provenance.campaign = campaign.name;
    input.provenance.propeller_name = campaign.propeller.name;
    input.provenance.supply_v = campaign.supply.value();
  }
  return input;
}

Input file_input(const fs::path& path) {
  Input input;
  input.folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  input.provenance.campaign = path.stem().string();
  input.provenance.source = path.filename().string();
  const std::string text = results::read_text(path);
  if (is_k_table(text)) {
    input.table = read_k_table(text, path.string());
  } else {
    input.steps = results::parse_steps(text, path.string());
  }
  return input;
}

/// A campaign folder, a folder with a steps.csv, or a file.
Input load(const std::string& path) {
  const bool campaign = fs::exists(fs::path(path) / "journal.jsonl") || fs::exists(fs::path(path) / "runs");
  if (fs::is_directory(path) && !campaign && !fs::exists(fs::path(path) / "steps.csv")) {
    throw ConfigurationError(path +
                             ": holds no campaign and no steps.csv; name a folder that kphi run or kphi import made");
  }
  Input input = campaign                 ? campaign_input(path)
                : fs::is_directory(path) ? file_input(fs::path(path) / "steps.csv")
                                         : file_input(path);
  input.provenance.tool_version = kVersion;
  return input;
}

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
  return options;
}

Identification identify_input(const Input& input, const FitRequest& request) {
  const IdentificationOptions options = options_of(request);
  Identification result =
      input.table.empty() ? identify(input.steps, options)
                          : identify_table(input.table, options.line, parse_speed_range(request.speed_range_rpm, {}));
  if (!request.propeller.empty()) result.propeller = request.propeller;
  if (result.propeller.empty()) result.propeller = input.provenance.campaign;
  if (request.diameter_in > 0) result.diameter_in = request.diameter_in;
  if (request.blades > 0) result.blades = request.blades;
  return result;
}

/// Fills the runs of `input` from their files and draws.
Figures draw_all(const Identification& identification, Input& input, const fs::path& figures) {
  RawSamples raw;
  if (input.campaign) {
    raw = read_raw_samples(identification, std::move(input.provenance.runs), input.folder);
    input.provenance.runs = std::move(raw.runs);
  }
  if (raw.shares.empty()) raw.shares = shares_of_steps(identification);
  Figures drawn = draw_figures(identification, raw.shares, figures, "gnuplot", raw.settling ? &*raw.settling : nullptr);
  if (!drawn.skipped.empty()) fmt::print(stderr, "kphi: figures skipped: {}\n", drawn.skipped);
  return drawn;
}

void write_page(const fs::path& page, const std::string& html) {
  results::MemoryOnlySync files;
  results::write_text(page, html, files);
  fmt::print(stderr, "report        {}\n", page.string());
}

/// The clock's uncertainty is the bench file's own, that of the air its instruments', unless somebody knows better.
AnalysisOptions analysis_options(const FitRequest& request, const Input& input, const Identification& identification) {
  AnalysisOptions options;
  if (const auto& air = identification.air) {
    options.air_density_kg_m3 = air->kg_m3;
    options.bench.air_density = air->u_kg_m3 / air->kg_m3;
  }
  if (const auto& clock = input.provenance.clock) options.bench.motor_clock = clock->u_gain;
  for (const std::string& text : request.uncertainties) set_uncertainty(options.bench, text);
  const bool nobody_looks = request.no_report && !request.json;
  if (nobody_looks) options.bootstrap.resamples = 0;
  return options;
}

void write_report(const Identification& identification, const Analysis& analysis, Input& input, const fs::path& page) {
  const Figures figures = draw_all(identification, input, page.parent_path() / "figures");
  write_page(page, format_report(identification, input.provenance, figures, &analysis));
}

/// From the first run without occlusion: a whole one lies in memory, 30 MB for the paper's 80 s.
Json raw_json(const Input& input) {
  const auto files = results::CampaignFolder::open(input.folder).complete_runs();
  if (files.empty()) throw FitError("no complete run lies in the folder; --raw needs one");
  const std::vector<results::RunRecording> runs{results::read_run(files.front())};
  return raw_to_json(identify_dynamics(runs), check_by_blade_pass(runs));
}

/// The paper's claims, by this propeller and the others of its family.
std::vector<Claim> family_claims(const FitRequest& request, const Identification& identification,
                                 const Analysis& analysis) {
  std::vector<FamilyMember> family{{identification, analysis}};
  for (const std::string& path : request.family) {
    const Input input = load(path);
    FitRequest same = request;
    same.propeller.clear();
    same.diameter_in = same.blades = 0;
    Identification other = identify_input(input, same);
    Analysis its = analyse(other, analysis_options(request, input, other));
    family.push_back({std::move(other), std::move(its)});
  }
  return test_claims(family);
}

void print_claims(const std::vector<Claim>& claims) {
  for (const Claim& claim : claims) {
    fmt::print("{:<11} {}", name_of(claim.verdict), claim.statement);
    if (claim.verdict != Verdict::not_tested)
      fmt::print(": {:.4g} ({:.4g} to {:.4g}) {}", claim.value, claim.lower, claim.upper, claim.unit);
    fmt::print("\n");
  }
}

void print_number(const char* name, double value, double error, const char* per) {
  const auto rpm = [](double k) { return to_newtons_per_rpm2(ThrustCoefficient(k)); };
  fmt::print("{:<10} {} N/(rad/s)^2{}  =  {} N/RPM^2{}\n", name, with_error(value, error), per,
             with_error(rpm(value), rpm(error)), per);
}

void print_headline(const LineFit& line) {
  print_number("K_T", line.K_T, line.K_T_standard_error, "");
  print_number("intercept", line.intercept, std::sqrt(line.covariance[0][0]), "");
  print_number("slope", line.slope_per_deg, std::sqrt(line.covariance[1][1]), " per degree");
}

void print_json(const Identification& identification, const Analysis& analysis, const std::vector<Claim>& claims,
                const Json& raw, const fs::path& coefficients) {
  const LineFit& line = identification.line;
  Json table = Json::array();
  for (const OcclusionCoefficient& row : identification.table)
    table.push_back({{"phi_deg", row.phi_deg}, {"k", row.k}, {"standard_error", row.standard_error}});
  Json json{{"coefficients", coefficients.string()},
            {"k_unit", "N/(rad/s)^2"},
            {"K_T", line.K_T},
            {"K_T_standard_error", line.K_T_standard_error},
            {"k_standard",
             identification.table.front().standard ? Json(identification.table.front().standard->k) : Json(nullptr)},
            {"air_density_kg_m3", identification.air ? Json(identification.air->kg_m3) : Json(nullptr)},
            {"anchored", line.anchored},
            {"intercept", line.intercept},
            {"slope_per_deg", line.slope_per_deg},
            {"covariance", line.covariance},
            {"table", table},
            {"steps_used", identification.selection.used.size()},
            {"steps_doubtful", identification.selection.doubtful.size()},
            {"estimator", name_of(identification.estimator)},
            {"weights", name_of(identification.weighting)},
            {"loss", name_of(identification.loss)},
            {"analysis", to_json(analysis)}};
  if (!claims.empty()) json["claims"] = to_json(claims);
  if (!raw.is_null()) json["raw"] = raw;
  fmt::print("{}\n", json.dump(2, ' ', false, Json::error_handler_t::replace));
}

void run_fit(const FitRequest& request) {
  Input input = load(request.path);
  const Identification identification = identify_input(input, request);
  fs::path file = request.out.empty() ? input.folder / "coefficients.yaml" : fs::path(request.out);
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  fs::create_directories(folder);
  results::MemoryOnlySync files;  // made again from steps.csv at any time
  const Analysis analysis = analyse(identification, analysis_options(request, input, identification));
  results::write_text(file, format_coefficients(identification, input.provenance) + format_uncertainty(analysis),
                      files);
  for (const DoubtfulStep& doubtful : identification.selection.doubtful) {
    fmt::print(stderr, "{:<13} phi {} deg, repetition {}, step {}: {}\n", doubtful.left_out ? "left out" : "kept",
               doubtful.step.occlusion_deg, doubtful.step.repetition, doubtful.step.step + 1, doubtful.reason);
  }
  for (const RejectedPoint& point : analysis.rejected) {
    fmt::print(stderr, "rejected      phi {} deg, repetition {}, step {}: {:+.3f} N off, robust weight {:.2f}\n",
               point.phi_deg, point.repetition, point.step + 1, point.residual_n, point.robust_weight);
  }
  const Json raw = request.raw && input.campaign ? raw_json(input) : Json();
  std::vector<Claim> claims;
  if (!request.family.empty()) claims = family_claims(request, identification, analysis);
  if (request.json) {
    print_json(identification, analysis, claims, raw, file);
  } else {
    print_headline(identification.line);
    if (const auto& standard = identification.table.front().standard)
      print_number("k_standard", standard->k, standard->standard_error, "");
    print_claims(claims);
    if (!raw.is_null()) fmt::print("{}\n", raw.dump(2));
  }
  for (const std::string& remark : analysis.remarks) fmt::print(stderr, "line          {}\n", remark);
  if (!identification.air)
    fmt::print(stderr, "air density   unknown: k holds for the air of that day; write ambient: into the bench file\n");
  fmt::print(stderr, "coefficients  {}\n", file.string());
  if (!request.no_report) write_report(identification, analysis, input, folder / "report.html");
}

/// The speeds that carried the fit. The file prints them to a thousandth RPM; that much more on either side takes the
/// same steps again.
SpeedRange fitted_range(const std::string& path, SpeedRange range) {
  const YAML::Node ends = YAML::LoadFile(path)["provenance"]["fit"]["speed_range_rpm"];
  if (!ends.IsDefined() || ends.size() != 2) return range;
  const double slack = 1e-3;
  return {from_rpm(ends[0].as<double>() - slack).value(), from_rpm(ends[1].as<double>() + slack).value()};
}

/// The campaign as its coefficients.yaml says that it was fitted.
Identification identify_again(const Input& input, const std::string& path) {
  const auto file = compensation::load_coefficients((fs::path(path) / "coefficients.yaml").string());
  IdentificationOptions options;
  options.line.anchored = file.line.anchored;
  for (const Radians& point : file.line.points) options.line.points_deg.push_back(to_degrees(point));
  options.speed_range = fitted_range(file.path, options.speed_range);
  if (!file.table.empty() && file.table.front().at_speed) options.at_speed_rad_s = file.table.front().at_speed->value();
  return identify(input.steps, options);
}

struct ReportRequest {
  std::vector<std::string> folders;
  std::string out;
};

/// One page of several campaigns; their figures go beside it, a folder each.
void report_several(const ReportRequest& request) {
  const fs::path page = request.out.empty() ? fs::path("report.html") : fs::path(request.out);
  const fs::path figures = page.parent_path() / "figures";
  std::vector<Chapter> chapters;
  std::vector<const Identification*> family;
  for (const std::string& path : request.folders) {
    Input input = load(path);
    Chapter chapter{identify_again(input, path), {}, {}};
    chapter.analysis = analyse(chapter.identification, analysis_options({}, input, chapter.identification));
    chapter.figures = draw_all(chapter.identification, input, figures / fmt::format("{}", chapters.size() + 1));
    chapter.provenance = std::move(input.provenance);
    chapters.push_back(std::move(chapter));
  }
  for (const Chapter& chapter : chapters) family.push_back(&chapter.identification);
  write_page(page, format_reports(chapters, draw({family_figure(family)}, figures)));
}

void run_report(const ReportRequest& request) {
  if (request.folders.size() > 1) return report_several(request);
  const std::string& path = request.folders.front();
  Input input = load(path);
  const Identification identification = identify_again(input, path);
  write_report(identification, analyse(identification, analysis_options({}, input, identification)), input,
               request.out.empty() ? fs::path(path) / "report.html" : fs::path(request.out));
}

template <class Enum>
std::map<std::string, Enum> names(std::initializer_list<Enum> values) {
  std::map<std::string, Enum> result;
  for (const Enum value : values) result.emplace(name_of(value), value);
  return result;
}

}  // namespace

void add_fit(CLI::App& app, int& exit_code) {
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
  command->add_option("--estimator", request->estimator, "which k: origin, offset, polynomial, speed (default: origin)")
      ->transform(CLI::CheckedTransformer(
          names({Estimator::through_origin, Estimator::with_offset, Estimator::polynomial, Estimator::at_speed})));
  command->add_option("--weights", request->weighting, "equal, thrust, effective-variance (default: equal)")
      ->transform(CLI::CheckedTransformer(names({Weighting::equal, Weighting::thrust, Weighting::effective_variance})));
  command->add_option("--loss", request->loss, "none, huber, cauchy, tukey (default: none)")
      ->transform(CLI::CheckedTransformer(names({Loss::none, Loss::huber, Loss::cauchy, Loss::tukey})));
  command->add_option("--u", request->uncertainties,
                      "NAME=VALUE, standard uncertainty of calibration, cross-axis, clock, density (relative) or "
                      "alignment-deg; may be repeated");
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
  on_run(*command, exit_code, [request] { run_fit(*request); });
}

void add_report(CLI::App& app, int& exit_code) {
  auto request = std::make_shared<ReportRequest>();
  CLI::App* command = app.add_subcommand("report", "draw report.html of fitted campaigns again, several on one page");
  command->add_option("DIR", request->folders, "campaign folders with steps.csv and coefficients.yaml")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--out", request->out, "page (default: report.html in DIR; of several: here)");
  on_run(*command, exit_code, [request] { run_report(*request); });
}

}  // namespace kphi::fit
