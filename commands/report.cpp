#include "commands/report.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "base/error.hpp"
#include "fit/coefficients/recorded_fit.hpp"
#include "fit/report/detail_figures.hpp"
#include "fit/report/raw_samples.hpp"
#include "fit/report/report.hpp"
#include "results/file_layer.hpp"

namespace kphi::fit {
namespace {

namespace fs = std::filesystem;

/// Fills the runs of `input` from their files and draws.
Figures draw_all(const Identification& identification, FitInput& input, const fs::path& figures) {
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
  if (page.has_parent_path()) fs::create_directories(page.parent_path());
  results::MemoryOnlySync files;  // drawn again at any time
  results::write_text(page, html, files);
  fmt::print(stderr, "report        {}\n", page.string());
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
    FittedFolder fitted = fitted_again(path);
    Chapter chapter{std::move(fitted.identification), {}, {}, std::move(fitted.analysis)};
    chapter.figures = draw_all(chapter.identification, fitted.input, figures / fmt::format("{}", chapters.size() + 1));
    chapter.provenance = std::move(fitted.input.provenance);
    chapters.push_back(std::move(chapter));
  }
  for (const Chapter& chapter : chapters) family.push_back(&chapter.identification);
  write_page(page, format_reports(chapters, draw({family_figure(family)}, figures)));
}

void run_report(const ReportRequest& request) {
  if (request.folders.size() > 1) return report_several(request);
  const std::string& path = request.folders.front();
  FittedFolder fitted = fitted_again(path);
  write_report(fitted.identification, fitted.analysis, fitted.input,
               request.out.empty() ? fs::path(path) / "report.html" : fs::path(request.out));
}

}  // namespace

AnalysisOptions analysis_options(const FitInput& input, const Identification& identification) {
  AnalysisOptions options;
  if (const auto& air = identification.air) {
    options.air_density_kg_m3 = air->kg_m3;
    options.bench.air_density = air->u_kg_m3 / air->kg_m3;
  }
  if (const auto& clock = input.provenance.clock) options.bench.motor_clock = clock->u_gain;
  return options;
}

FittedFolder fitted_again(const std::string& folder) {
  FitInput input = load_input(folder);
  const fs::path file = fs::path(folder) / "coefficients.yaml";
  if (!fs::exists(file))
    throw ConfigurationError(fmt::format("{}: not fitted yet; `kphi fit {}` comes first", folder, folder));
  if (!input.table.empty())
    throw ConfigurationError(folder + ": steps.csv is a table of k, not of steps; `kphi fit` draws its report");
  const RecordedFit record = read_recorded_fit(file.string());
  Identification identification = identify_again(input.steps, record);
  AnalysisOptions options = analysis_options(input, identification);
  if (record.bench) options.bench = *record.bench;
  input.provenance.bench = options.bench;
  Analysis analysis = analyse(identification, options);
  return {std::move(input), std::move(identification), std::move(analysis)};
}

void write_report(const Identification& identification, const Analysis& analysis, FitInput& input,
                  const fs::path& page) {
  const Figures figures = draw_all(identification, input, page.parent_path() / "figures");
  write_page(page, format_report(identification, input.provenance, figures, &analysis));
}

void add_report(CLI::App& app, int&) {
  auto request = std::make_shared<ReportRequest>();
  CLI::App* command = app.add_subcommand("report", "draw report.html of fitted campaigns again, several on one page");
  command->add_option("DIR", request->folders, "campaign folders with steps.csv and coefficients.yaml")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--out", request->out, "page (default: report.html in DIR; of several: here)");
  command->footer("kphi report results/<5x2> results/<5x3> results/<6x2> results/<6x3> --out four.html");
  command->callback([request] { run_report(*request); });
}

}  // namespace kphi::fit
