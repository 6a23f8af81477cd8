#include "commands/compare_export.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include "base/error.hpp"
#include "commands/report.hpp"
#include "fit/export/run_export.hpp"
#include "fit/export/targets.hpp"
#include "fit/propellers/compare.hpp"
#include "fit/report/family_table.hpp"
#include "results/file_layer.hpp"
#include "results/run_reader.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;

struct CompareRequest {
  std::vector<std::string> results;
  std::string expect;
  std::vector<std::string> predict;
  bool claims = false;
  bool json = false;
};

/// Propellers of a family: every folder fitted again as its coefficients.yaml says.
void compare_family(const CompareRequest& request) {
  if (!request.expect.empty()) throw ConfigurationError("--expect is a verdict on two results");
  std::vector<PropellerSize> sizes;
  for (const std::string& text : request.predict) sizes.push_back(parse_propeller_size(text));
  std::vector<FamilyMember> family;
  for (const std::string& path : request.results) {
    if (!fs::is_directory(path))
      throw ConfigurationError(path + ": several propellers are compared from their folders, with steps.csv in them");
    FittedFolder fitted = fitted_again(path);
    family.push_back({std::move(fitted.identification), std::move(fitted.analysis)});
  }
  const FamilyFindings findings = findings_of(family, sizes);
  fmt::print("{}", request.json ? to_json(findings).dump(2) + "\n" : family_text(findings));
}

void run_compare(const CompareRequest& request, int& exit_code) {
  if (request.results.size() > 2 || request.claims || !request.predict.empty()) return compare_family(request);
  const Comparison comparison = compare(load_result(request.results.front()), load_result(request.results.back()));
  fmt::print("{}", request.json ? comparison_json(comparison) : comparison_table(comparison));
  if (!request.expect.empty() && request.expect != word(comparison.verdict)) {
    fmt::print(stderr, "kphi: expected that they {}, found: {}\n", request.expect, word(comparison.verdict));
    exit_code = static_cast<int>(ExitCode::data_rejected);
  }
}

struct ExportRequest {
  std::string file, to, out;
  ExportOptions options;
};

void tell_lost(const std::vector<std::string>& lost) {
  for (const std::string& line : lost) fmt::print(stderr, "not held  {}\n", line);
}

void refuse_terminal(const ExportRequest& request) {
  if (request.out.empty() && request.to == "mcap" && ::isatty(STDOUT_FILENO) == 1)
    throw ConfigurationError("mcap is no text; name a file with --out or send it into a pipe");
}

void export_run(const ExportRequest& request) {
  if (request.to != "csv" && request.to != "mcap")
    throw ConfigurationError(request.file +
                             ": a run holds samples; they go --to csv or mcap. Coefficients come from `kphi fit`");
  const results::RunRecording run = results::read_run(request.file);
  std::ofstream file;
  if (!request.out.empty()) file.open(request.out, std::ios::binary | std::ios::trunc);
  std::ostream& out = request.out.empty() ? std::cout : file;
  tell_lost(request.to == "csv" ? run_to_csv(run, out) : run_to_mcap(run, out));
  out.flush();
  if (!out) throw RecordError((request.out.empty() ? "stdout" : request.out) + ": could not be written");
}

void export_coefficients(const ExportRequest& request) {
  const fs::path place(request.file);
  const fs::path file = fs::is_directory(place) ? place / "coefficients.yaml" : place;
  if (!fs::exists(file))
    throw ConfigurationError(fmt::format("{}: not fitted yet; `kphi fit {}` comes first", request.file, request.file));
  const compensation::Coefficients coefficients = compensation::load_coefficients(file.string());
  for (const Target& target : targets()) {
    if (request.to != target.name) continue;
    const Export result = target.write(coefficients, request.options);
    results::MemoryOnlySync files;  // made again at any time
    if (request.out.empty()) std::fwrite(result.text.data(), 1, result.text.size(), stdout);
    if (!request.out.empty()) results::write_text(request.out, result.text, files);
    tell_lost(result.lost);
  }
}

void run_export(const ExportRequest& request) {
  refuse_terminal(request);
  if (fs::path(request.file).extension() == ".h5") {
    export_run(request);
  } else {
    export_coefficients(request);
  }
}

}  // namespace

void add_compare(CLI::App& app, int& exit_code) {
  auto request = std::make_shared<CompareRequest>();
  CLI::App* command = app.add_subcommand(
      "compare",
      "two results: differences, their uncertainties, a verdict; several propellers: the paper's statements");
  command
      ->add_option("RESULT", request->results,
                   "two of: coefficients.yaml, campaign folder, steps.csv without occlusions; or fitted folders of "
                   "several propellers")
      ->required()
      ->expected(2, 100)
      ->check(CLI::ExistingPath);
  command->add_option("--expect", request->expect, "exit with 5 when the verdict is another")
      ->check(CLI::IsMember({"agree", "differ"}));
  command->add_flag("--json", request->json, "the comparison as JSON on stdout");
  command->add_flag("--claims", request->claims, "the paper's statements of two propellers, too (default of three)");
  command
      ->add_option("--predict", request->predict,
                   "DIAMETERxBLADES, k of a propeller that nobody measured, from three; may be repeated")
      ->allow_extra_args(false);
  command->footer(
      "kphi compare results/<monday> results/<tuesday> --expect agree\n"
      "kphi compare results/<5x2> results/<5x3> results/<6x2> results/<6x3> --predict 7x3");
  command->callback([request, &exit_code] { run_compare(*request, exit_code); });
}

void add_export(CLI::App& app, int&) {
  auto request = std::make_shared<ExportRequest>();
  CLI::App* command = app.add_subcommand("export", "coefficients for a flight stack, samples for a viewer");
  command->add_option("FILE", request->file, "coefficients.yaml, campaign folder, or a run (RUN.h5, to csv or mcap)")
      ->required()
      ->check(CLI::ExistingPath);
  std::vector<std::string> names;
  std::string footer;
  for (const Target& target : targets()) {
    names.emplace_back(target.name);
    footer += fmt::format("  {:<11} {}\n", target.name, target.what);
  }
  command->add_option("--to", request->to, "the target")->required()->check(CLI::IsMember(names));
  command->add_option("--out", request->out, "file (default: stdout)");
  command->add_option("--phi-deg", request->options.phi_deg, "for targets with one constant per motor (default 0)");
  command->add_option("--speed-max-rpm", request->options.speed_max_rpm, "at full output (default: the file's)")
      ->check(CLI::PositiveNumber);
  command->add_option("--motors", request->options.motors, "for px4 and gazebo (default 4)")->check(CLI::Range(1, 12));
  command->footer(
      "Targets:\n" + footer +
      "\nkphi export results/<folder> --to px4 --speed-max-rpm 19100\n"
      "kphi export results/<folder>/runs/5x3_phi090_rep2.h5 --to mcap --out run.mcap\n"
      "\nWhat a target cannot hold is told on stderr.\n"
      "ArduPilot's MOT_THST_EXPO and Betaflight's thrust_linear are shapes of the command, not k: no export.");
  command->callback([request] { run_export(*request); });
}

}  // namespace kphi::fit
