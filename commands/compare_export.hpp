// kphi compare, kphi export.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::fit {

/// `kphi compare A B`: table or JSON on stdout. Sets `exit_code` to 0; with --expect to 5 when the verdict is another.
void add_compare(CLI::App& app, int& exit_code);
/// `kphi export FILE --to TARGET`: text on stdout or in --out; what the target cannot hold on stderr.
void add_export(CLI::App& app, int& exit_code);

}  // namespace kphi::fit
