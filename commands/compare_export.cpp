#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "commands/commands.hpp"
#include "commands/inputs.hpp"
#include "commands/outputs.hpp"
#include "compensation/file/plausibility.hpp"
#include "compensation/units.hpp"
#include "fit/coefficients/error_in_flight.hpp"
#include "fit/export/run_export.hpp"
#include "fit/export/targets.hpp"
#include "fit/propellers/claims.hpp"
#include "fit/propellers/compare.hpp"
#include "fit/propellers/history.hpp"
#include "fit/report/fit_summary.hpp"
#include "fit/uncertainty/readiness.hpp"
#include "profiles/vehicle.hpp"
#include "results/campaign_folder.hpp"
#include "results/checksums.hpp"
#include "results/file_layer.hpp"
#include "results/run_reader.hpp"

namespace kphi::commands {
namespace {

using namespace fit;

namespace fs = std::filesystem;

struct CompareRequest {
  std::vector<std::string> results;
  std::string expect;
  std::string truth;
  std::vector<std::string> predict;
  bool claims = false;
  bool json = false;
};

/// Propellers of a family, or the history of one: every folder fitted again as its coefficients.yaml says.
ExitCode compare_family(const CompareRequest& request) {
  if (!request.expect.empty()) throw ConfigurationError("--expect needs exactly two results: it is their verdict");
  std::vector<PropellerSize> sizes;
  for (const std::string& text : request.predict) sizes.push_back(parse_propeller_size(text));
  std::vector<Fitted> family;
  std::vector<std::string> when;
  for (const std::string& path : request.results) {
    if (!fs::is_directory(path))
      throw ConfigurationError(
          path + ": not a folder; several propellers are compared from their folders, with steps.csv in them");
    auto [input, fitted] = fitted_again(path);
    if (fitted.identification.alone())
      throw ConfigurationError(path + ": a log without occlusions; compare it with logs alone");
    family.push_back(std::move(fitted));
    when.push_back(input.provenance.measured_utc);
  }
  if (of_one_propeller(family) && !request.claims && sizes.empty()) {
    const History history = history_of(family, request.results, when);
    fmt::print("{}", request.json ? history_json(history) : history_text(history));
    return ExitCode::ok;
  }
  FamilyFindings findings = findings_of(family, sizes);
  if (!request.claims) findings.claims.clear();
  fmt::print("{}", request.json ? Json(findings).dump(2) + "\n" : family_text(findings));
  return ExitCode::ok;
}

/// A log: steps without occlusion, or those without it of a table that is named itself.
std::optional<FitInput> log_of(const std::string& path) {
  const fs::path place(path);
  const bool is_table = !fs::is_directory(place) && place.extension() == ".csv";
  if (!is_table && !fs::is_directory(place)) return std::nullopt;
  if (const fs::path file = place / "coefficients.yaml"; !is_table && fs::exists(file))
    if (!compensation::load_coefficients(file.string(), compensation::Need::thrust_coefficient).alone())
      return std::nullopt;
  if (!is_table && !fs::exists(place / "steps.csv")) return std::nullopt;
  if (is_table && fs::exists(place.parent_path() / "journal.jsonl"))
    results::require_intact(results::CampaignFolder::open(place.parent_path()));
  FitInput input = load_input(path);
  if (!input.table.empty())
    throw ConfigurationError(path + ": a table of k; compare the coefficients that `kphi fit` makes of it");
  const auto occluded = [](const auto& step) { return step.occlusion_deg > 0; };
  if (!is_table && std::ranges::any_of(input.steps, occluded)) return std::nullopt;  // not fitted yet
  std::erase_if(input.steps, occluded);
  return input;
}

struct ComparedLogs {
  std::vector<ComparedResult> results;
  std::string remark;  ///< on their speeds; may be empty
};

/// Logs over the speeds that all of them have, since k of a real propeller rises with speed.
ComparedLogs over_common_speeds(const std::vector<FitInput>& logs, const std::vector<std::string>& names) {
  std::vector<Fitted> fitted;
  SpeedRange common{0, std::numeric_limits<double>::infinity()};
  for (const FitInput& log : logs) {
    const Identification& one = fitted.emplace_back(fitted_log(log)).identification;
    common = {std::max(common.min_rad_s, one.speed_min_rad_s), std::min(common.max_rad_s, one.speed_max_rad_s)};
  }
  const bool differ = std::ranges::any_of(fitted, [&](const Fitted& one) {
    const Identification& log = one.identification;
    return !same_level(log.speed_min_rad_s, common.min_rad_s) || !same_level(log.speed_max_rad_s, common.max_rad_s);
  });
  ComparedLogs compared;
  if (!(common.max_rad_s > common.min_rad_s)) {
    compared.remark = "they have no range of speeds in common: each over its own";
  } else if (differ) {
    compared.remark = fmt::format(
        "compared from {:.0f} to {:.0f} RPM, which {} reached; alone, each is fitted over all its speeds",
        to_rpm(RadPerSec(common.min_rad_s)), to_rpm(RadPerSec(common.max_rad_s)), logs.size() == 2 ? "both" : "all");
    for (std::size_t i = 0; i < logs.size(); ++i) fitted[i] = fitted_log(logs[i], common);
  }
  for (std::size_t i = 0; i < logs.size(); ++i)
    compared.results.push_back(result_of_log(fitted[i], logs[i].provenance.origin, names[i]));
  return compared;
}

Comparison compare_logs(const std::vector<FitInput>& logs, const CompareRequest& request) {
  ComparedLogs compared = over_common_speeds(logs, request.results);
  Comparison comparison = compare(std::move(compared.results.front()), std::move(compared.results.back()));
  if (!compared.remark.empty()) comparison.remarks.push_back(compared.remark);
  if (std::ranges::any_of(logs, [](const FitInput& log) { return log.record.has_value(); }))
    comparison.remarks.push_back("of the campaign its runs at 0° alone: the log has no occlusions");
  return comparison;
}

/// All of them, if each is a log; empty if one is not.
std::vector<FitInput> logs_of(const std::vector<std::string>& paths) {
  std::vector<FitInput> logs;
  for (const std::string& path : paths) {
    auto log = log_of(path);
    if (!log) return {};
    logs.push_back(std::move(*log));
  }
  return logs;
}

/// The runs of a fitted campaign at 0°, to be fitted as its file says; nullopt if its steps are not beside that.
std::optional<FitInput> campaign_at_zero(const std::string& path) {
  const fs::path place(path), folder = fs::is_directory(place) ? place : place.parent_path();
  const fs::path file = coefficient_file_of(path);
  if (!fs::exists(folder / "steps.csv") || file.filename() != "coefficients.yaml") return std::nullopt;
  results::require_seal(results::read_text(file), file.string());
  FitInput campaign = load_input(folder.empty() ? "." : folder.string());
  if (!campaign.table.empty()) return std::nullopt;
  campaign.record = read_recorded_fit(file.string());
  std::erase_if(campaign.steps, [](const auto& step) { return step.occlusion_deg > 0; });
  return campaign;
}

/// Two logs, or a log and a campaign's runs at 0°; empty if neither is a log.
std::vector<FitInput> two_logs_of(const std::vector<std::string>& paths) {
  auto a = log_of(paths.front()), b = log_of(paths.back());
  if (!a && !b) return {};
  if (!a) a = campaign_at_zero(paths.front());
  if (!b) b = campaign_at_zero(paths.back());
  return a && b ? std::vector{*a, *b} : std::vector<FitInput>();
}

/// K_T of several logs side by side.
ExitCode compare_many(const std::vector<FitInput>& logs, const CompareRequest& request) {
  if (!request.expect.empty()) throw ConfigurationError("--expect needs exactly two results: it is their verdict");
  ComparedLogs compared = over_common_speeds(logs, request.results);
  const SideBySide table = side_by_side(std::move(compared.results), compared.remark);
  fmt::print("{}", request.json ? side_by_side_json(table) : side_by_side_table(table));
  return ExitCode::ok;
}

ComparedResult loaded(const std::optional<FitInput>& log, const std::string& path) {
  if (log) return result_of_log(fitted_log(*log), log->provenance.origin, path);
  refuse_other_input(path, InputKind::coefficients);
  return load_result(path);
}

ExitCode compare_truth(const CompareRequest& request) {
  if (request.results.size() > 1) throw ConfigurationError("--truth compares one RESULT with the simulated truth");
  const TruthCheck check =
      check_against_truth(loaded(log_of(request.results.front()), request.results.front()), request.truth);
  fmt::print("{}", check.text);
  if (check.close) return ExitCode::ok;
  fmt::print(stderr,
             "kphi: too far from the truth: beyond what is allowed, the result's own ± or, if larger, 0.5 % of K_T and "
             "2 % of the slope\n");
  return ExitCode::data_rejected;
}

ExitCode run_compare(const CompareRequest& request) {
  if (!request.truth.empty()) return compare_truth(request);
  if (request.results.size() < 2) throw ConfigurationError("compare needs two RESULTs, or one RESULT and --truth");
  const bool family = request.claims || !request.predict.empty();
  if (request.results.size() > 2 && !family)
    if (const auto logs = logs_of(request.results); !logs.empty()) return compare_many(logs, request);
  if (request.results.size() > 2 || family) return compare_family(request);
  const auto logs = two_logs_of(request.results);
  const Comparison comparison = !logs.empty()
                                    ? compare_logs(logs, request)
                                    : compare(loaded(log_of(request.results.front()), request.results.front()),
                                              loaded(log_of(request.results.back()), request.results.back()));
  fmt::print("{}", request.json ? comparison_json(comparison) : comparison_table(comparison));
  if (request.expect.empty() || request.expect == word(comparison.verdict)) return ExitCode::ok;
  fmt::print(stderr, "kphi: expected that they {}, found: {}\n", request.expect, word(comparison.verdict));
  return ExitCode::data_rejected;
}

struct ExportRequest {
  std::string file, to, out, vehicle;
  bool accept = false;
  ExportOptions options;
};

void print_lost(const std::vector<std::string>& lost) {
  for (const std::string& line : lost) fmt::print(stderr, "left out  {}\n", line);
}

void export_run(const ExportRequest& request) {
  if (request.to != "csv" && request.to != "mcap")
    throw ConfigurationError(request.file + ": a run holds samples, not coefficients; export it --to csv or mcap");
  results::require_unchanged_run(request.file, results::digests_beside(request.file));
  const results::RunRecording run = results::read_run(request.file);
  std::ofstream file;
  if (!request.out.empty()) {
    write_output(request.out, "", request.to == "csv" ? "time_s,force_x_n," : "\x89MCAP kphi.Phase");
    file.open(request.out, std::ios::binary | std::ios::trunc);
  }
  std::ostream& out = request.out.empty() ? std::cout : file;
  print_lost(request.to == "csv" ? run_to_csv(run, out) : run_to_mcap(run, out));
  out.flush();
  if (!out) throw RecordError((request.out.empty() ? "stdout" : request.out) + ": could not be written");
}

void export_coefficients(const ExportRequest& request) {
  compensation::Coefficients coefficients =
      load_standing_coefficients(coefficient_file_of(request.file).string(), compensation::Need::thrust_coefficient);
  ExportOptions options = request.options;
  std::optional<profiles::Vehicle> vehicle;
  if (!request.vehicle.empty()) options.vehicle = &vehicle.emplace(profiles::load_vehicle(request.vehicle));
  const auto verdict = print_standing(coefficients, options.vehicle);
  if (verdict == Readiness::not_yet && !request.accept)
    throw DataRejected(fmt::format("{}: {}; nothing is exported; --accept does it all the same", coefficients.path,
                                   fit::words(*verdict)));
  if (vehicle)
    if (const auto there = error_in_flight(coefficients, *vehicle)) judge_for(coefficients, *there, *vehicle);
  for (const Target& target : targets()) {
    if (request.to != target.name) continue;
    const Export result = target.write(coefficients, options);
    if (request.out.empty()) std::fwrite(result.text.data(), 1, result.text.size(), stdout);
    if (!request.out.empty()) write_output(request.out, result.text);
    print_lost(result.lost);
  }
}

ExitCode run_export(const ExportRequest& request) {
  if (request.out.empty() && request.to == "mcap" && ::isatty(STDOUT_FILENO) == 1)
    throw ConfigurationError("mcap is binary, standard output is a terminal; name a file with --out, or use a pipe");
  const bool is_run = fs::path(request.file).extension() == ".h5";
  is_run ? export_run(request) : export_coefficients(request);
  return ExitCode::ok;
}

}  // namespace

void add_compare(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<CompareRequest>(
      program, exit_code, "compare",
      "compare two results (differences, uncertainties, verdict), the campaigns of one propeller over time, or the "
      "propellers of a family",
      "kphi compare results/<monday> results/<tuesday> --expect agree\n"
      "kphi compare results/*_icra2021_5in_3blade\n"
      "kphi compare results/<5x2> results/<5x3> results/<6x2> results/<6x3> --predict 7x3",
      run_compare);
  add_argument(command, "RESULT", request.results,
               "two of: coefficients.yaml, campaign folder, steps.csv without occlusions; any number of imported logs; "
               "or the fitted folders of one propeller, from four on for a control chart, or of several propellers")
      ->expected(1, 100)
      ->check(kExistingPath);
  command.add_option("--expect", request.expect, "exit with 5 unless this is the verdict")
      ->check(CLI::IsMember({"agree", "differ"}));
  command.add_flag("--json", request.json, "print the comparison as JSON");
  command
      .add_option("--truth", request.truth,
                  "compare one RESULT with this file of kphi sim --truth; exit with 5 if it is far off")
      ->check(kExistingFile);
  command.add_flag("--claims", request.claims, "check the paper's statements on these propellers");
  add_value(command, "--predict", "DIAMETERxBLADES", request.predict,
            "predict k of a propeller that nobody measured, from three others; may be repeated")
      ->allow_extra_args(false);
}

void add_export(CLI::App& program, ExitCode& exit_code) {
  const auto [command, request] = add_verb<ExportRequest>(
      program, exit_code, "export", "write coefficients for a flight stack, or samples for a viewer",
      "kphi export results/<folder> --to px4 --vehicle vehicle.yaml --out vehicle.params\n"
      "kphi export results/<folder>/runs/5x3_phi090_rep2.h5 --to mcap --out run.mcap",
      run_export);
  add_argument(command, "FILE", request.file, "coefficients.yaml, campaign folder, or a run (RUN.h5, to csv or mcap)")
      ->check(kExistingPath);
  std::vector<std::string> names;
  std::string footer;
  for (const Target& target : targets()) {
    names.emplace_back(target.name);
    footer += fmt::format("  {:<11} {}\n", target.name, target.what);
  }
  const auto those = [](bool Target::*property) {
    std::vector<std::string> named;
    for (const Target& target : targets())
      if (target.*property) named.emplace_back(target.name);
    return fmt::format("{}", fmt::join(named, ", "));
  };
  command.add_option("--to", request.to, "target, see below")->required()->check(one_of(names))->type_name("TARGET");
  add_value(command, "--out", "FILE", request.out, "output file (default: stdout)");
  add_value(command, "--vehicle", "FILE", request.vehicle,
            fmt::format("vehicle file, for targets that compute k from arm angles ({})", those(&Target::takes_vehicle)))
      ->check(kExistingFile);
  command.add_flag("--accept", request.accept, "export coefficients that are not fit to fly, too");
  begin_group(command, "What the file does not tell");
  command.add_option("--phi-deg", request.options.phi_deg,
                     "occlusion for targets with one constant per motor (default 0)");
  command
      .add_option("--speed-max-rpm", request.options.speed_max_rpm,
                  "speed at full output (default: the vehicle's, else the file's)")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--motors", request.options.motors,
                  fmt::format("number of motors ({}; default 4)", those(&Target::for_each_motor)))
      ->check(CLI::Range(1, 12));
  command
      .add_option_function<std::string>(
          "--turns", [&request = request](const std::string& text) { request.options.turns = parse_turns(text); },
          fmt::format("how the motors turn, seen from above, for the sign of their torque ({})",
                      those(&Target::for_each_motor)))
      ->type_name("ccw,cw,…");
  add_notes(command, "Targets:\n" + footer +
                         "\nkphi lists on stderr what a target cannot hold.\n"
                         "Of a log without occlusions (K_T alone) all but " +
                         those(&Target::needs_curve) + ", and all without --vehicle.");
}

}  // namespace kphi::commands
