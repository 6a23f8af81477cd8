// kphi info and kphi verify.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::results {

/// `kphi info RUN.h5|DIR [--json]`: shows its contents. Sets `exit_code`.
void add_info(CLI::App& app, int& exit_code);
/// `kphi verify RUN.h5|DIR [--json]`: checks it for damage, one line per problem. Sets `exit_code` to 0 or 5.
void add_verify(CLI::App& app, int& exit_code);

}  // namespace kphi::results
