// kphi run.
#pragma once

#include <CLI/CLI.hpp>

namespace kphi::daq {

void add_run(CLI::App& program, int& exit_code);

}  // namespace kphi::daq
