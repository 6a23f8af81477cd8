// kphi report.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>

#include "commands/fit_input.hpp"
#include "fit/uncertainty/analysis.hpp"

namespace kphi::fit {

/// `kphi report DIR…`: report.html and figures again, from steps.csv with what coefficients.yaml tells of its fit;
/// several on one page. Sets `exit_code` to 0 or 5 (data that cannot be fitted).
void add_report(CLI::App& app, int& exit_code);

/// A folder with steps and coefficients, fitted and judged again as the file says that it was.
struct FittedFolder {
  FitInput input;
  Identification identification;
  Analysis analysis;
};
[[nodiscard]] FittedFolder fitted_again(const std::string& folder);

/// With its figures beside it. Reads the runs of a campaign for the raw samples; what they tell goes into `input`.
void write_report(const Identification& identification, const Analysis& analysis, FitInput& input,
                  const std::filesystem::path& page);

/// What the campaign's own files know of errors: the clock's from the bench file, the air's from its instruments.
[[nodiscard]] AnalysisOptions analysis_options(const FitInput& input, const Identification& identification);

}  // namespace kphi::fit
