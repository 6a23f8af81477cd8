// kphi fit.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::fit {

/// `kphi fit DIR|STEPS.csv|K.csv`: coefficients.yaml, report.html and figures/; the headline on stdout. Sets
/// `exit_code` to 0 or 5 (data that cannot be fitted).
void add_fit(CLI::App& app, int& exit_code);

}  // namespace kphi::fit
