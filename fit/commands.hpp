// kphi fit, kphi report.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::fit {

/// `kphi fit DIR|STEPS.csv|K.csv`: coefficients.yaml, report.html and figures/; the headline on stdout. Sets
/// `exit_code` to 0 or 5 (data that cannot be fitted).
void add_fit(CLI::App& app, int& exit_code);
/// `kphi report DIR`: report.html and figures again, from steps.csv with the options that coefficients.yaml tells.
void add_report(CLI::App& app, int& exit_code);

}  // namespace kphi::fit
