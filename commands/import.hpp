// kphi import.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::fit {

/// `kphi import FILE… --out DIR`: foreign tables → DIR/<name>/steps.csv and import.json; what is wrong with each, by
/// name and count, on stderr, or with --json the whole as JSON lines on stdout. Sets `exit_code` to 0 or 5 (some table
/// was not imported, or has too few rows for a k); the others are imported all the same.
void add_import(CLI::App& app, int& exit_code);

}  // namespace kphi::fit
