// kphi replay.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::daq {

/// `kphi replay RUN.h5|DIR [--json]`: raw samples to step means again, as CSV on stdout. What steps.csv of the campaign
/// folder says must be the same bytes; the first line that is not goes to stderr and `exit_code` becomes 5.
void add_replay(CLI::App& app, int& exit_code);

}  // namespace kphi::daq
